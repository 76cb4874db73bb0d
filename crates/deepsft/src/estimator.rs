//! The estimator: one image and its camera in, maps and a judgement of them out.

use crate::bundle::{FoundRule, MODEL_FILE, ModelBundle, WEIGHTS_FILE};
use crate::device::Device;
use crate::error::DeepSftError;
use crate::estimate::{Estimate, Judgement};
use crate::finding::FinderKind;
use crate::photo_consistency::TemplateLuminance;
use deepsft_geometry::{
    CANONICAL_HEIGHT, CANONICAL_WIDTH, Camera, CanonicalViews, CanonicalWarp, GeometryError, ImageSize, Maps, Picture,
    RestSurface, canonical_camera, check_size, remove_islands, turned_clockwise,
};
#[cfg(feature = "webgpu")]
use deepsft_inference::{DeviceKind, GpuError, GpuExecutor};
use deepsft_inference::{Executor, FoldedNetwork, PlanError, Stage};
use std::sync::{Arc, Mutex, PoisonError};

/// Pieces of the mask with fewer pixels than this fraction of the largest are taken as mistakes: a sheet that a hand cuts in
/// two leaves larger ones. On synthetic frames nearly all that is below a third is a few pixels.
const MIN_PIECE: f64 = 0.1;

/// Milliseconds that the stages of a frame took, over all views that were tried.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EstimateTimes {
    /// The canonical warp.
    pub warp_ms: f64,
    /// The network.
    pub network_ms: f64,
    /// The judgement of its maps.
    pub judge_ms: f64,
}

/// A model on a device. Cheap to call, made once; clones share what is in it.
///
/// [`Estimator::estimate`] does a frame; the stages are public so that a caller who has a clock can
/// time them.
#[derive(Clone, Debug)]
pub struct Estimator {
    runners: Arc<Runners>,
    canonical: Camera,
    found: FoundRule,
    template: TemplateLuminance,
}

/// Executors that wait for the next frame; one of a compact network holds some 25 MB.
const MAX_IDLE: usize = 2;

/// A network on its device.
#[derive(Debug)]
enum Runner {
    Cpu(Executor),
    #[cfg(feature = "webgpu")]
    WebGpu(GpuExecutor),
}

impl Runner {
    fn new(network: &FoldedNetwork, device: &Device) -> Result<Self, DeepSftError> {
        let image = (CANONICAL_WIDTH, CANONICAL_HEIGHT);
        let refused = DeepSftError::content::<PlanError>(WEIGHTS_FILE);
        match device {
            Device::Cpu => Ok(Self::Cpu(network.executor(image).map_err(refused)?)),
            #[cfg(feature = "webgpu")]
            Device::WebGpu(gpu) => match GpuExecutor::new(gpu, &network.config, image, &network.weights) {
                Ok(executor) => Ok(Self::WebGpu(executor)),
                Err(GpuError::Plan(PlanError::Architecture(name))) => Err(DeepSftError::DeviceUnavailable {
                    device: DeviceKind::WebGpu,
                    reason: format!("networks of the architecture {name} run on the processor only"),
                }),
                Err(GpuError::Plan(error)) => Err(refused(error)),
                Err(error) => Err(failed(&error)),
            },
        }
    }

    async fn run(&mut self, canonical: &Picture) -> Result<(), DeepSftError> {
        match self {
            Self::Cpu(executor) => Ok(executor.run(canonical)?),
            #[cfg(feature = "webgpu")]
            Self::WebGpu(executor) => executor.run(canonical).await.map_err(|error| failed(&error)),
        }
    }

    fn read(
        &mut self,
        stage: Stage,
        seen: Option<&[bool]>,
        surface: Option<&RestSurface>,
        maps: &mut Maps,
    ) -> Result<(), GeometryError> {
        match self {
            Self::Cpu(executor) => executor.read(stage, seen, surface, maps),
            #[cfg(feature = "webgpu")]
            Self::WebGpu(executor) => executor.read(stage, seen, surface, maps),
        }
    }
}

#[cfg(feature = "webgpu")]
fn failed(error: &GpuError) -> DeepSftError {
    DeepSftError::Execution(error.to_string())
}

/// Runners of one network, one for each caller at a time.
#[derive(Debug)]
struct Runners {
    network: FoldedNetwork,
    /// Where its rest positions are looked up.
    surface: Option<RestSurface>,
    device: Device,
    idle: Mutex<Vec<Runner>>,
}

impl Runners {
    /// The maps of each of `stages`.
    async fn infer(
        &self,
        canonical: &Picture,
        stages: &[Stage],
        seen: Option<&[bool]>,
    ) -> Result<Vec<Maps>, DeepSftError> {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let free = idle().pop();
        let mut runner = free.map_or_else(|| Runner::new(&self.network, &self.device), Ok)?;
        let ran = runner.run(canonical).await;
        let read = |&stage: &Stage| {
            let mut maps = Maps::empty(canonical.size());
            runner.read(stage, seen, self.surface.as_ref(), &mut maps)?;
            Ok(maps)
        };
        let maps = ran.and_then(|()| stages.iter().map(read).collect());
        let mut idle = idle();
        if idle.len() < MAX_IDLE {
            idle.push(runner);
        }
        maps
    }
}

impl Estimator {
    /// Puts the model of `bundle` on `device`.
    ///
    /// # Errors
    /// [`DeepSftError::BundleContent`] when the bundle's training camera has no 480 x 270 image,
    /// [`DeepSftError::DeviceUnavailable`] for R50F on a GPU, [`DeepSftError::Execution`]
    /// when the GPU is lost.
    pub fn new(bundle: &ModelBundle, device: &Device) -> Result<Self, DeepSftError> {
        let size = (bundle.camera().size().width, bundle.camera().size().height);
        if size != (CANONICAL_WIDTH, CANONICAL_HEIGHT) {
            let reason = format!("the training camera's image has {size:?} pixels, expected 480 x 270");
            return Err(DeepSftError::content(MODEL_FILE)(reason));
        }
        let runners = Runners {
            idle: Mutex::new(vec![Runner::new(bundle.network(), device)?]),
            network: bundle.network().clone(),
            surface: bundle.network().config.rest_surface(bundle.template()),
            device: device.clone(),
        };
        Ok(Self {
            runners: Arc::new(runners),
            canonical: *bundle.camera(),
            found: bundle.card().found,
            template: TemplateLuminance::new(bundle.template().texture()),
        })
    }

    /// Number of weights.
    pub fn parameters(&self) -> usize {
        self.runners.network.parameters()
    }

    /// The camera of the training images; the canonical images of those that lie across are its own.
    pub fn training_camera(&self) -> &Camera {
        &self.canonical
    }

    /// The camera of the canonical image and the maps of an image of `size` (columns, rows), see [`canonical_camera`].
    pub fn canonical_camera(&self, size: ImageSize) -> Camera {
        canonical_camera(&self.canonical, size)
    }

    /// Stage 1, canonical warp: `image` of `camera` as the training camera would have taken it, turned by a quarter for an upright
    /// image ([`canonical_camera`]).
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when the image is not of the camera's size.
    pub fn canonical_image(&self, image: &Picture, camera: &Camera) -> Result<Picture, DeepSftError> {
        let canonical = self.canonical_camera(camera.size());
        Ok(CanonicalWarp::new(camera, &canonical).apply(image)?)
    }

    /// Stage 2, the network: maps of a canonical image, upright or across, small islands of the mask removed. `view` took it: the canonical
    /// camera or one that is zoomed out. The network sees what is at a depth z as large as the training camera sees it at z over the zoom:
    /// its depths are corrected by that factor.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when the image is not canonical, [`DeepSftError::Execution`] when the
    /// device fails.
    pub async fn infer(&self, canonical: &Picture, view: &Camera) -> Result<Maps, DeepSftError> {
        let mut maps = self.run(canonical, &[Stage::RegistrationRefinement], None).await?;
        let mut maps = maps.pop().unwrap_or_else(|| Maps::empty(canonical.size()));
        remove_islands(&mut maps, MIN_PIECE);
        let zoom = (view.focal().x / self.canonical_camera(view.size()).focal().x) as f32;
        if zoom != 1.0 {
            maps.scale_depth(zoom);
        }
        Ok(maps)
    }

    /// Stage 2 taken apart, for ablations: the maps that the network has after each of its blocks, small islands removed. The last
    /// are those of [`Estimator::infer`]. With `seen` (row-major) they are at its pixels and nowhere else, whatever the network's own mask
    /// says there: for comparing models over the same pixels.
    ///
    /// The compact network's mask does not depend on the stage. That of the paper's network is where the depth of the same
    /// stage says that something is seen.
    ///
    /// # Errors
    /// As [`Estimator::infer`], and [`DeepSftError::Geometry`] when `seen` has another number of pixels than the image.
    pub async fn infer_stages(
        &self,
        canonical: &Picture,
        seen: Option<&[bool]>,
    ) -> Result<Vec<(Stage, Maps)>, DeepSftError> {
        let stages = self.stages();
        let mut maps = self.run(canonical, stages, seen).await?;
        if seen.is_none() {
            for maps in &mut maps {
                remove_islands(maps, MIN_PIECE);
            }
        }
        Ok(stages.iter().copied().zip(maps).collect())
    }

    /// The maps of each of `stages`. The network sees an upright image turned by a quarter: unless its training had other ranges, objects
    /// were rolled any way.
    async fn run(
        &self,
        canonical: &Picture,
        stages: &[Stage],
        seen: Option<&[bool]>,
    ) -> Result<Vec<Maps>, DeepSftError> {
        let upright = self.canonical_camera(canonical.size());
        check_size(canonical.size(), upright.size())?;
        if upright == self.canonical {
            return self.runners.infer(canonical, stages, seen).await;
        }
        if let Some(seen) = seen {
            check_size((seen.len(), 1), (canonical.width() * canonical.height(), 1))?;
        }
        let seen = seen.map(|seen| turned_clockwise(seen, canonical.width()));
        let turned = canonical.turned_clockwise();
        let maps = self.runners.infer(&turned, stages, seen.as_deref()).await?;
        Ok(maps.iter().map(Maps::turned_anticlockwise).collect())
    }

    /// The stages of [`Estimator::infer_stages`].
    pub fn stages(&self) -> &'static [Stage] {
        self.runners.network.config.architecture.stages()
    }

    /// Whether a mask that covers this fraction of the image is enough for the template to be there.
    pub(crate) fn covers_enough(&self, area: f32) -> bool {
        f64::from(area) >= self.found.min_area
    }

    /// Stage 3: is the template there, and do the maps explain the image?
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when image and maps differ in size.
    pub fn judge(&self, canonical: &Picture, maps: &Maps) -> Result<Judgement, DeepSftError> {
        check_size(maps.size(), canonical.size())?;
        let area = Judgement::area_of(maps);
        let confidence = self
            .template
            .consistency(canonical, maps)
            .unwrap_or(0.0)
            .clamp(0.0, 1.0);
        Ok(Judgement {
            found: self.covers_enough(area) && confidence >= self.found.min_confidence,
            confidence: confidence as f32,
            area,
            shape_determined: false,
        })
    }

    /// The estimate that `maps` are of the image `canonical` of `canonical_camera`, judged.
    ///
    /// # Errors
    /// As [`Estimator::judge`].
    pub fn estimate_of(
        &self,
        canonical: Picture,
        canonical_camera: Camera,
        maps: Maps,
    ) -> Result<Estimate, DeepSftError> {
        Ok(Estimate {
            by: Some(FinderKind::Network),
            judgement: self.judge(&canonical, &maps)?,
            maps,
            canonical,
            canonical_camera,
            surface: None,
        })
    }

    /// All stages, in the nearest view that holds what is seen of the object: the canonical camera's, or where the object is not found in
    /// that or reaches over its border, one zoomed out as far as the image of `camera` goes on.
    ///
    /// # Errors
    /// As the stages.
    pub async fn estimate(&self, image: &Picture, camera: &Camera) -> Result<Estimate, DeepSftError> {
        Ok(self.estimate_timed(image, camera, || 0.0).await?.0)
    }

    /// As [`Estimator::estimate`], with what the stages took by `clock_ms`, which gives the time in milliseconds from any origin.
    ///
    /// # Errors
    /// As the stages.
    pub async fn estimate_timed(
        &self,
        image: &Picture,
        camera: &Camera,
        clock_ms: impl Fn() -> f64,
    ) -> Result<(Estimate, EstimateTimes), DeepSftError> {
        let views = CanonicalViews::new(&self.canonical, camera);
        let mut times = EstimateTimes::default();
        let mut timed = async |view: &Camera| -> Result<Estimate, DeepSftError> {
            let began = clock_ms();
            let canonical = CanonicalWarp::new(camera, view).apply(image)?;
            let warped = clock_ms();
            let maps = self.infer(&canonical, view).await?;
            let inferred = clock_ms();
            let estimate = self.estimate_of(canonical, *view, maps)?;
            times.warp_ms += warped - began;
            times.network_ms += inferred - warped;
            times.judge_ms += clock_ms() - inferred;
            Ok(estimate)
        };
        let mut best = timed(views.nearest()).await?;
        for view in &views.all()[1..] {
            if best.judgement.found && !views.cuts(&best.canonical_camera, &best.maps) {
                break;
            }
            let wider = timed(view).await?;
            if wider.judgement.found {
                best = wider;
            }
        }
        Ok((best, times))
    }
}
