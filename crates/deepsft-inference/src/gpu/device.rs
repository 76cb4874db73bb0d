//! A GPU: how it is started, its buffers, and what went wrong on it.

use crate::plan::PlanError;
use deepsft_geometry::GeometryError;
use half::f16;
use std::collections::HashMap;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};
use wgpu::util::DeviceExt;

/// Reports what went wrong on a GPU.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// No GPU is there, or it cannot be started.
    #[error("no GPU can be used: {0}")]
    NotStarted(String),
    /// The GPU was taken away: by its driver, by the browser, or because it was unplugged. Start another one.
    #[error("the GPU was lost: {0}")]
    Lost(String),
    /// The GPU refuses the work.
    #[error("the GPU failed: {0}")]
    Failed(String),
    /// The network does not fit its weights.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// An image has another size.
    #[error(transparent)]
    Image(#[from] GeometryError),
}

/// A started GPU; clones share it.
#[derive(Clone, Debug)]
pub struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    name: String,
    is_software: bool,
    has_f16: bool,
    failure: Arc<Mutex<Option<GpuError>>>,
    /// Compiled shaders by their text.
    pipelines: Arc<Mutex<HashMap<String, wgpu::ComputePipeline>>>,
    #[cfg(test)]
    submissions: Arc<std::sync::atomic::AtomicUsize>,
}

impl Gpu {
    /// Starts the fastest GPU.
    ///
    /// # Errors
    /// [`GpuError::NotStarted`] where there is none.
    pub async fn start() -> Result<Self, GpuError> {
        let instance = wgpu::Instance::default();
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let not_started = |error: &dyn fmt::Display| GpuError::NotStarted(error.to_string());
        let adapter = instance.request_adapter(&options).await;
        let adapter = adapter.map_err(|error| not_started(&error))?;
        let info = adapter.get_info();
        let (device, queue) = adapter
            .request_device(&wgpu::DeviceDescriptor {
                required_features: adapter.features() & wgpu::Features::SHADER_F16,
                ..Default::default()
            })
            .await
            .map_err(|error| not_started(&error))?;
        let failure = Arc::new(Mutex::new(None));
        let first = failure.clone();
        let failed = move |error| {
            // A lost GPU says more than what fails because of it.
            let mut first = first.lock().unwrap_or_else(PoisonError::into_inner);
            if first.is_none() || matches!(error, GpuError::Lost(_)) {
                *first = Some(error);
            }
        };
        let lost = failed.clone();
        device.set_device_lost_callback(move |_, message| lost(GpuError::Lost(message)));
        let failed = move |error: wgpu::Error| failed(GpuError::Failed(error.to_string()));
        device.on_uncaptured_error(Arc::new(failed));
        Ok(Self {
            has_f16: device.features().contains(wgpu::Features::SHADER_F16),
            device,
            queue,
            name: info.name,
            is_software: info.device_type == wgpu::DeviceType::Cpu,
            failure,
            pipelines: Arc::default(),
            #[cfg(test)]
            submissions: Arc::default(),
        })
    }

    /// Returns its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether the processor plays the GPU.
    pub fn is_software(&self) -> bool {
        self.is_software
    }

    /// Whether plans store their filters, and the maps between layers, as numbers of 16 bits; they add in 32. It moves u and v of the
    /// shipped network by 0.00002 in the median and 0.0006 at most (three frames, beside the processor in 32 bits).
    pub fn has_f16(&self) -> bool {
        self.has_f16
    }

    /// The same GPU for plans of 32 bits only.
    #[cfg(test)]
    pub(crate) fn in_f32(&self) -> Self {
        Self {
            has_f16: false,
            ..self.clone()
        }
    }

    /// Returns how often it was given work so far.
    #[cfg(test)]
    pub(crate) fn submissions(&self) -> usize {
        self.submissions.load(std::sync::atomic::Ordering::Relaxed)
    }

    /// Gives the GPU back: from now on whatever uses it fails with [`GpuError::Lost`].
    #[cfg(test)]
    pub(crate) fn stop(&self) {
        self.device.destroy();
    }

    /// Checks that nothing went wrong so far; a GPU on which something did is not used any more.
    ///
    /// # Errors
    /// [`GpuError`] names the first failure.
    pub fn check(&self) -> Result<(), GpuError> {
        let failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        failure.clone().map_or(Ok(()), Err)
    }

    /// A buffer of `length` zeros that kernels read and write.
    pub(crate) fn zeros(&self, length: usize) -> wgpu::Buffer {
        use wgpu::BufferUsages as Usage;
        self.buffer((4 * length) as u64, Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST)
    }

    /// A buffer of `size` bytes into which results are copied to be read.
    pub(crate) fn readable(&self, size: u64) -> wgpu::Buffer {
        self.buffer(size, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST)
    }

    fn buffer(&self, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size,
            usage,
            mapped_at_creation: false,
        })
    }

    /// A buffer that kernels only read.
    pub(crate) fn constants(&self, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let label = None;
        self.device
            .create_buffer_init(&wgpu::util::BufferInitDescriptor { label, contents, usage })
    }

    /// A buffer of numbers that kernels only read, of 32 bits or of 16.
    pub(super) fn numbers(&self, values: &[f32], half: bool) -> wgpu::Buffer {
        let in_half = |&value: &f32| f16::from_f32(value).to_le_bytes();
        let bytes: Vec<u8> = match half {
            true => values.iter().flat_map(in_half).collect(),
            false => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        };
        self.constants(&bytes, wgpu::BufferUsages::STORAGE)
    }

    /// The pipeline of a shader, compiled if it is new.
    pub(super) fn pipeline(&self, source: &str) -> wgpu::ComputePipeline {
        let mut pipelines = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = pipelines.get(source) {
            return pipeline.clone();
        }
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            cache: None,
        });
        pipelines.insert(source.to_owned(), pipeline.clone());
        pipeline
    }

    /// Gives a list of work to the GPU.
    pub(crate) fn submit(&self, encoder: wgpu::CommandEncoder) {
        #[cfg(test)]
        self.submissions.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        self.queue.submit([encoder.finish()]);
    }

    /// The numbers of a buffer that can be mapped, after the GPU has done all it was given.
    pub(crate) async fn mapped<T>(
        &self,
        buffer: &wgpu::Buffer,
        read: impl FnOnce(&mut dyn Iterator<Item = f32>) -> T,
    ) -> Result<T, GpuError> {
        let (sender, receiver) = oneshot::async_channel();
        buffer.map_async(wgpu::MapMode::Read, .., |mapped| drop(sender.send(mapped)));
        // In a browser this does nothing, and the event loop brings the answer.
        let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        polled.map_err(|error| GpuError::Failed(error.to_string()))?;
        let failed = |error: &dyn fmt::Display| self.check().err().unwrap_or(GpuError::Failed(error.to_string()));
        let mapped = receiver.await.map_err(|error| failed(&error))?;
        mapped.map_err(|error| failed(&error))?;
        // In a browser refusals arrive while it is waited for: what was mapped then holds no results.
        if let Err(error) = self.check() {
            buffer.unmap();
            return Err(error);
        }
        let view = buffer.get_mapped_range(..).map_err(|error| failed(&error))?;
        let result = read(&mut view.as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes)));
        drop(view);
        buffer.unmap();
        Ok(result)
    }
}
