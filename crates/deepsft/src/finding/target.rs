//! What is looked for.

use crate::bundle::ModelBundle;
use crate::device::Device;
use crate::error::DeepSftError;
use crate::estimator::Estimator;
use deepsft_geometry::{Camera, CanonicalViews, ImageSize, Picture, Template, canonical_camera, training_camera};

/// An object to look for: its template, and its network if one was trained for it.
#[derive(Clone, Debug)]
pub struct Target {
    template: Template,
    network: Option<Estimator>,
}

impl Target {
    /// A picture that is printed `width_mm` wide on something that bends. Nothing is trained.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when the width is not positive and finite.
    pub fn from_picture(picture: Picture, width_mm: f64) -> Result<Self, DeepSftError> {
        let height_mm = width_mm * picture.height() as f64 / picture.width() as f64;
        Ok(Self::from_template(Template::thin_shell(picture, width_mm, height_mm)?))
    }

    /// A template: of the label around a bottle [`Template::around_cylinder`]. Nothing is trained.
    pub fn from_template(template: Template) -> Self {
        Self {
            template,
            network: None,
        }
    }

    /// The template of a model, with its network on `device`.
    ///
    /// # Errors
    /// As [`Estimator::new`].
    pub fn from_model(bundle: &ModelBundle, device: &Device) -> Result<Self, DeepSftError> {
        Ok(Self {
            template: bundle.template().clone(),
            network: Some(Estimator::new(bundle, device)?),
        })
    }

    /// The object at rest.
    pub fn template(&self) -> &Template {
        &self.template
    }

    /// Its network.
    pub fn network(&self) -> Option<&Estimator> {
        self.network.as_ref()
    }

    /// The camera in whose image it is measured in images of `size` (columns, rows): that of the network's training, else
    /// [`training_camera`], turned by a quarter for upright images ([`canonical_camera`]).
    pub fn canonical_camera(&self, size: ImageSize) -> Camera {
        canonical_camera(&self.training_camera(), size)
    }

    /// The cameras in one of whose images it is measured in images of `camera`: the canonical one, and where the image reaches further,
    /// wider ones.
    pub fn canonical_views(&self, camera: &Camera) -> CanonicalViews {
        CanonicalViews::new(&self.training_camera(), camera)
    }

    /// The camera in whose images that lie across it is measured.
    pub fn training_camera(&self) -> Camera {
        let network = self.network.as_ref();
        network.map_or_else(training_camera, |network| *network.training_camera())
    }
}
