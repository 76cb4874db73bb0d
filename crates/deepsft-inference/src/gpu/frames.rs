//! Frames: an image goes in, some maps come back.

use super::device::{Gpu, GpuError};
use super::shader::Kernel;
use deepsft_geometry::{Picture, check_size};
use wgpu::Buffer;

/// A network's work for an image of one size: one list for the GPU, of which only the results come back.
#[derive(Debug)]
pub(crate) struct FramePipeline {
    gpu: Gpu,
    image: [usize; 2],
    work: Vec<Kernel>,
    /// The image's bytes, see [`FramePipeline::pixels`].
    pixels: Buffer,
    /// What comes back, and the numbers that came last.
    results: Vec<(Buffer, Vec<f32>)>,
    readable: Buffer,
    /// Whether a run was given up before its results were read.
    is_open: bool,
}

impl FramePipeline {
    /// A buffer for an image of `image` (columns, rows) pixels: red, green and blue in turns, a byte each.
    pub(crate) fn pixels(gpu: &Gpu, [width, height]: [usize; 2]) -> Buffer {
        gpu.zeros((3 * width * height).div_ceil(4))
    }

    pub(crate) fn new(
        gpu: &Gpu,
        work: Vec<Kernel>,
        (image, pixels): ([usize; 2], Buffer),
        results: Vec<Buffer>,
    ) -> Self {
        Self {
            gpu: gpu.clone(),
            image,
            work,
            pixels,
            readable: gpu.readable(results.iter().map(Buffer::size).sum()),
            results: (results.into_iter())
                .map(|buffer| (buffer.clone(), vec![0.0; buffer.size() as usize / 4]))
                .collect(),
            is_open: false,
        }
    }

    /// The numbers of a result of the last frame.
    pub(crate) fn result(&self, k: usize) -> &[f32] {
        &self.results[k].1
    }

    /// Takes an image through the network.
    pub(crate) async fn run(&mut self, image: &Picture) -> Result<(), GpuError> {
        let [width, height] = self.image;
        check_size(image.size(), (width, height))?;
        self.gpu.check()?;
        if std::mem::replace(&mut self.is_open, true) {
            self.readable.unmap();
        }
        // Whole words are written.
        let (whole, rest) = image.rgb().split_at(image.rgb().len() / 4 * 4);
        self.gpu.queue.write_buffer(&self.pixels, 0, whole);
        if !rest.is_empty() {
            let mut word = [0; 4];
            word[..rest.len()].copy_from_slice(rest);
            self.gpu.queue.write_buffer(&self.pixels, whole.len() as u64, &word);
        }
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        self.work.iter().for_each(|kernel| kernel.run(&mut pass));
        drop(pass);
        let mut at = 0;
        for (buffer, _) in &self.results {
            encoder.copy_buffer_to_buffer(buffer, 0, &self.readable, at, buffer.size());
            at += buffer.size();
        }
        self.gpu.submit(encoder);
        let results = self.results.iter_mut().flat_map(|(_, values)| values);
        let read = |numbers: &mut dyn Iterator<Item = f32>| results.zip(numbers).for_each(|(to, number)| *to = number);
        self.gpu.mapped(&self.readable, read).await?;
        self.is_open = false;
        Ok(())
    }
}
