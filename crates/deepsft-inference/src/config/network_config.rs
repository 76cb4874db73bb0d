//! What a network is built from: its architecture and the images and depths it is for.

use super::architecture::{Architecture, CompactConfig};
use super::depth_range::DepthRange;
use crate::plan::PlanError;
use deepsft_geometry::{Camera, RestSurface, Template};
use serde::{Deserialize, Serialize};

/// Relative difference by which a length may change when it is written as text and read again.
const ROUNDING: f64 = 1e-6;

/// Describes everything that is needed to build a network again from its weights.
///
/// In a `model.json` the fields of the architecture stand beside the others, and `architecture` says which it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NetworkConfig {
    /// Layers.
    #[serde(flatten)]
    pub architecture: Architecture,
    /// Size of the template, mm (the compact network's isometric depth cue needs it). Of a network that says rest positions the
    /// sides of the cube in which they are.
    pub template_size_mm: [f64; 2],
    /// Focal length of the training camera, pixels.
    pub focal: f64,
    /// Principal point of the training camera, pixels.
    pub principal_point: [f64; 2],
    /// Depths the network can say.
    pub depth_range: DepthRange,
}

impl NetworkConfig {
    /// Describes a network of `architecture` for a template of `template_size_mm` seen by the pinhole `camera` that training
    /// images are rendered with.
    pub fn new(architecture: Architecture, template_size_mm: [f64; 2], camera: &Camera) -> Self {
        Self {
            architecture,
            template_size_mm,
            focal: camera.focal().x,
            principal_point: camera.principal_point().to_array(),
            depth_range: DepthRange::default(),
        }
    }

    /// Describes the compact network, see [`NetworkConfig::new`].
    pub fn compact(template_size_mm: [f64; 2], camera: &Camera) -> Self {
        let layers = CompactConfig::default();
        Self::new(Architecture::Compact(layers), template_size_mm, camera)
    }

    /// Returns the same with rest positions ([`CompactConfig::has_rest_positions`]) in a cube of `side_mm`, if the network is a compact
    /// one: as many bins for each coordinate as for the depth.
    pub fn with_rest_positions(mut self, side_mm: f64) -> Self {
        if let Architecture::Compact(shape) = &mut self.architecture {
            shape.bins = vec![shape.bins[2]; 4];
            self.template_size_mm = [side_mm; 2];
        }
        self
    }

    /// Returns whether the network says rest positions, see [`CompactConfig::has_rest_positions`].
    pub fn has_rest_positions(&self) -> bool {
        self.as_compact().is_some_and(CompactConfig::has_rest_positions)
    }

    /// Returns the surface of `template` on which rest positions are looked up, if the network says them.
    pub fn rest_surface(&self, template: &Template) -> Option<RestSurface> {
        self.has_rest_positions().then(|| RestSurface::new(template))
    }

    /// Returns the layers of a compact network, if it is one.
    pub fn as_compact(&self) -> Option<&CompactConfig> {
        match &self.architecture {
            Architecture::Compact(shape) => Some(shape),
            _ => None,
        }
    }

    /// Checks that a network of this shape can be made: widths and numbers within bounds far above what is
    /// useful, so that a damaged description costs no memory.
    ///
    /// # Errors
    /// [`PlanError::Config`] names the field.
    pub fn check(&self) -> Result<(), PlanError> {
        self.architecture.check().map_err(PlanError::Config)?;
        let refused = |reason: &str| Err(PlanError::Config(reason.to_owned()));
        let ([width, height], DepthRange { near_mm, far_mm }) = (self.template_size_mm, self.depth_range);
        let lengths = [width, height, self.focal, near_mm];
        if !lengths.iter().all(|l| l.is_finite() && *l > 0.0) {
            return refused("template_size_mm, focal and depth_range must be positive and finite");
        }
        if !self.principal_point.iter().all(|c| c.is_finite()) {
            return refused("principal_point must be finite");
        }
        if !(far_mm.is_finite() && far_mm > near_mm) {
            return refused("depth_range ends before it begins");
        }
        Ok(())
    }

    /// Checks that the network is for this template and this training camera. A network of another size or focal length
    /// computes as well, and its depths are wrong.
    ///
    /// # Errors
    /// [`PlanError::Config`] names the field.
    pub fn check_fits(&self, template: &Template, camera: &Camera) -> Result<(), PlanError> {
        let same = |a: f64, b: f64| (a - b).abs() <= ROUNDING * a.abs().max(b.abs());
        let both = |a: [f64; 2], b: [f64; 2]| same(a[0], b[0]) && same(a[1], b[1]);
        let size @ [width, height] = match self.has_rest_positions() {
            true => [RestSurface::side_mm(template); 2],
            false => template.size_mm().to_array(),
        };
        let own @ [w, h] = self.template_size_mm;
        let (focal @ [fx, fy], f) = (camera.focal().to_array(), self.focal);
        let (centre @ [cx, cy], point @ [x, y]) = (camera.principal_point().to_array(), self.principal_point);
        let reason = if !both(own, size) {
            format!("template_size_mm is {w} x {h}, the template has {width} x {height} mm")
        } else if !both([f; 2], focal) {
            format!("focal is {f}, the training camera has {fx} and {fy}")
        } else if !both(point, centre) {
            format!("principal_point is ({x}, {y}), the training camera has ({cx}, {cy})")
        } else {
            return Ok(());
        };
        Err(PlanError::Config(reason))
    }
}
