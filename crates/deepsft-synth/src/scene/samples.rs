//! Synthetic samples: a pure function of (template, configuration, seed, index).

use crate::error::SynthError;
use crate::random::{Stream, generator};
use crate::sample::Sample;
use crate::scene::composition::Scene;
use crate::scene::synthesizer::Synthesizer;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::raster::VisibleSurface;
use rand::RngExt;

/// Draws of shape and pose before the one that shows most is taken.
const VIEW_TRIES: usize = 12;

impl Synthesizer {
    /// Sample `index` of the data set `seed`: always the same for the same template, configuration, photographs,
    /// seed and index.
    pub fn sample(&self, seed: u64, index: u64) -> Sample {
        let mut rng = generator(seed, index, Stream::Shape);
        let noise_seed = rng.random();
        if rng.random_bool(self.config().empty_probability) {
            let scene = Scene::without_template(self, &mut generator(seed, index, Stream::Scene), &mut rng);
            return scene.compose_without_template(noise_seed);
        }
        let scene = self.scene(seed, index);
        let mut best: Option<(usize, Vec<DVec3>, VisibleSurface)> = None;
        for _ in 0..VIEW_TRIES {
            let vertices_camera = self.sample_vertices(&mut rng);
            let sheet = VisibleSurface::new(self.template().mesh(), &vertices_camera, &self.config().camera);
            let visible = scene.visible_area(&sheet);
            if best.as_ref().is_none_or(|(most, ..)| visible > *most) {
                best = Some((visible, vertices_camera, sheet));
            }
            if visible >= self.config().min_visible_px {
                break;
            }
        }
        match best {
            Some((_, vertices, sheet)) => scene.compose(vertices, &sheet, noise_seed),
            None => scene.compose_without_template(noise_seed),
        }
    }

    /// Draws all of sample `index` of the data set `seed` but the sheet's shape and pose. That is background, other sheets,
    /// light, paper, occluders, camera effects. For sequences, in which only the sheet moves.
    pub fn scene(&self, seed: u64, index: u64) -> Scene<'_> {
        self.scene_like(None, seed, index)
    }

    /// [`Synthesizer::scene`] under the light, on the paper and with the camera settings of `other` if any is given.
    pub(crate) fn scene_like(&self, other: Option<&Scene<'_>>, seed: u64, index: u64) -> Scene<'_> {
        Scene::with_template(self, other, &mut generator(seed, index, Stream::Scene))
    }

    /// Renders the template with its vertices at `vertices_camera` (mm, camera frame), without disturbances. The paper is matt,
    /// under even light from the camera, before mid grey; there are no occluders, and the camera is ideal.
    ///
    /// # Errors
    /// [`SynthError::VertexCount`] when there are not as many vertices as the template's mesh has;
    /// [`SynthError::Geometry`] when one is not finite.
    pub fn render_clean(&self, vertices_camera: Vec<DVec3>) -> Result<Sample, SynthError> {
        Scene::clean(self).render(vertices_camera, 0)
    }
}
