//! An image as finders take it.

use super::picture_descriptors::{ImageDescriptors, SharedDescriptorNetwork};
use crate::error::DeepSftError;
use deepsft_finding::{FeatureOptions, Features, feature_image};
use deepsft_geometry::{Camera, CanonicalWarp, Picture};
use std::borrow::Cow;

/// One image with what finders make of it: each thing is made when it is first asked for, and serves all targets.
#[derive(Debug)]
pub struct View<'a> {
    image: &'a Picture,
    camera: &'a Camera,
    canonical: Option<(Camera, Cow<'a, Picture>)>,
    features: Option<(Features, Camera)>,
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
            descriptors: None,
        }
    }

    /// The camera that took the image.
    pub fn camera(&self) -> &Camera {
        self.camera
    }

    /// The image as `canonical` would have taken it.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when the image is not of its camera's size.
    pub fn canonical(&mut self, canonical: &Camera) -> Result<&Picture, DeepSftError> {
        if self.canonical.as_ref().is_none_or(|(camera, _)| camera != canonical) {
            let picture = match self.camera == canonical && self.image.size() == canonical.size() {
                true => Cow::Borrowed(self.image),
                false => Cow::Owned(CanonicalWarp::new(self.camera, canonical).apply(self.image)?),
            };
            self.canonical = None;
            let (_, picture) = self.canonical.insert((*canonical, picture));
            return Ok(picture);
        }
        match &self.canonical {
            Some((_, picture)) => Ok(picture),
            None => Ok(self.image),
        }
    }

    /// Descriptors of the image as `canonical` would have taken it.
    ///
    /// # Errors
    /// As [`View::canonical`].
    pub(super) fn descriptors(
        &mut self,
        network: &SharedDescriptorNetwork,
        canonical: &Camera,
    ) -> Result<&ImageDescriptors, DeepSftError> {
        if self.descriptors.is_none() || self.canonical.as_ref().is_none_or(|(camera, _)| camera != canonical) {
            let image = self.canonical(canonical)?;
            let descriptors = network.describe(image);
            return Ok(self.descriptors.insert(descriptors));
        }
        match &self.descriptors {
            Some(descriptors) => Ok(descriptors),
            // Just looked at.
            None => Err(DeepSftError::Execution {
                reason: "the image has no descriptors".to_owned(),
            }),
        }
    }

    /// Corners and descriptors of the image, and the camera in whose pixels they are.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] for a camera without pixels.
    pub fn features(&mut self) -> Result<(&Features, &Camera), DeepSftError> {
        if self.features.is_none() {
            let (image, camera) = feature_image(self.image, self.camera)?;
            self.features = Some((Features::of(&image, &FeatureOptions::default()), camera));
        }
        let (features, camera) = self.features.get_or_insert_with(|| (Features::default(), *self.camera));
        Ok((features, camera))
    }
}
