//! An image as finders take it.

use super::picture_descriptors::{ImageDescriptors, SharedDescriptorNetwork};
use crate::error::DeepSftError;
use deepsft_finding::Features;
use deepsft_geometry::{Camera, CanonicalWarp, ImageSize, Picture};
use std::borrow::Cow;

/// One image with what finders make of it: each thing is made when it is first asked for, and serves all targets.
#[derive(Debug)]
pub struct View<'a> {
    image: &'a Picture,
    camera: &'a Camera,
    canonical: Option<(Camera, Cow<'a, Picture>)>,
    features: Option<(Features, Camera)>,
    detailed_features: Option<Option<(Features, Camera)>>,
    descriptors: Option<ImageDescriptors>,
}

impl<'a> View<'a> {
    /// `image`, which `camera` took.
    pub fn new(image: &'a Picture, camera: &'a Camera) -> Self {
        Self {
            image,
            camera,
            canonical: None,
            features: None,
            detailed_features: None,
            descriptors: None,
        }
    }

    /// The image.
    pub fn image(&self) -> &'a Picture {
        self.image
    }

    /// The camera that took it.
    pub fn camera(&self) -> &'a Camera {
        self.camera
    }

    /// Columns and rows of the image, pixels.
    pub fn size(&self) -> ImageSize {
        self.camera.size()
    }

    /// The image as `canonical` would have taken it.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when the image is not of its camera's size.
    pub fn canonical(&mut self, canonical: &Camera) -> Result<&Picture, DeepSftError> {
        let known = self.canonical.take().filter(|(camera, _)| camera == canonical);
        let of_canonical = match known {
            Some(known) => known,
            None => {
                // They are of another camera's image.
                self.descriptors = None;
                let picture = match self.camera == canonical && self.image.size() == canonical.size() {
                    true => Cow::Borrowed(self.image),
                    false => Cow::Owned(CanonicalWarp::new(self.camera, canonical).apply(self.image)?),
                };
                (*canonical, picture)
            }
        };
        Ok(&self.canonical.insert(of_canonical).1)
    }

    /// Descriptors of the image as `canonical` would have taken it, by the one network that all targets share.
    ///
    /// # Errors
    /// As [`View::canonical`].
    pub(super) fn descriptors(
        &mut self,
        network: &SharedDescriptorNetwork,
        canonical: &Camera,
    ) -> Result<&ImageDescriptors, DeepSftError> {
        self.canonical(canonical)?;
        let descriptors = match self.descriptors.take() {
            Some(known) => known,
            None => network.describe(self.canonical(canonical)?)?,
        };
        Ok(self.descriptors.insert(descriptors))
    }

    /// Corners and descriptors of the image, and the camera in whose pixels they are.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] for a camera without pixels.
    pub fn features(&mut self) -> Result<(&Features, &Camera), DeepSftError> {
        let known = match self.features.take() {
            Some(known) => known,
            None => Features::of(self.image, self.camera)?,
        };
        let (features, camera) = self.features.insert(known);
        Ok((features, camera))
    }

    /// The same at twice the size. `None` of an image that has not the pixels ([`Features::in_detail`]).
    ///
    /// # Errors
    /// As [`View::features`].
    pub fn detailed_features(&mut self) -> Result<Option<(&Features, &Camera)>, DeepSftError> {
        let known = match self.detailed_features.take() {
            Some(known) => known,
            None => Features::in_detail(self.image, self.camera)?,
        };
        let known = self.detailed_features.insert(known).as_ref();
        Ok(known.map(|(features, camera)| (features, camera)))
    }
}
