//! From pictures to a network's input, and from its output to depth and registration maps.

use super::any_network::Network;
use super::compact::INPUT_MULTIPLE;
use super::maps::NetworkMaps;
use crate::error::NetworkError;
use burn::tensor::{Device, Tensor, TensorData};
use deepsft_geometry::{Maps, Picture, check_size};
use deepsft_inference::Stage;

/// Converts pictures to the compact network's input, [N, 3, H, W] with values 0..=1. H and W are the pictures' sides (all the
/// same) rounded up to multiples of 16, black below and to the right.
pub fn images_to_tensor(pictures: &[&Picture], device: &Device) -> Tensor<4> {
    padded_to_tensor(pictures, INPUT_MULTIPLE, device)
}

/// Converts pictures of one size to the input of [`Network::forward_maps`], [N, 3, H, W] with values 0..=1.
pub fn pictures_to_tensor(pictures: &[&Picture], device: &Device) -> Tensor<4> {
    padded_to_tensor(pictures, 1, device)
}

fn padded_to_tensor(pictures: &[&Picture], multiple: usize, device: &Device) -> Tensor<4> {
    let (width, height) = pictures.first().map_or((0, 0), |p| (p.width(), p.height()));
    let (w, h) = (width.next_multiple_of(multiple), height.next_multiple_of(multiple));
    let mut values = vec![0.0_f32; pictures.len() * 3 * h * w];
    for (n, picture) in pictures.iter().enumerate() {
        for (pixel, color) in picture.rgb().chunks_exact(3).enumerate() {
            let (x, y) = (pixel % width, pixel / width);
            for (channel, &value) in color.iter().enumerate() {
                values[((n * 3 + channel) * h + y) * w + x] = f32::from(value) / 255.0;
            }
        }
    }
    Tensor::from_data(TensorData::new(values, [pictures.len(), 3, h, w]), device)
}

impl Network {
    /// Returns the stages that the network has, see [`deepsft_inference::Architecture::stages`].
    pub fn stages(&self) -> &'static [Stage] {
        self.config().architecture.stages()
    }

    /// Estimates the maps of each of `pictures` (all of one size, taken by the training camera). They hold refined depth and
    /// registration where the mask's probability is at least one half, outside as [`Maps`] says. `device` is the network's; it
    /// is read from once.
    ///
    /// # Errors
    /// [`NetworkError::Execution`] when the device no longer answers.
    pub async fn infer(&self, pictures: &[&Picture], device: &Device) -> Result<Vec<Maps>, NetworkError> {
        let answer = [Stage::RegistrationRefinement];
        let mut stages = self.infer_at(pictures, device, &answer, None).await?;
        Ok(stages.pop().unwrap_or_default())
    }

    /// Estimates the maps of one picture at the pixels of `seen` (row-major, of the picture's size) and nowhere else. The
    /// network's own mask does not count, so that networks are compared over the same pixels.
    ///
    /// # Errors
    /// As [`Network::infer`], and [`deepsft_geometry::GeometryError::MapSize`] when `seen` has another number of pixels than the picture.
    pub async fn infer_where(&self, picture: &Picture, seen: &[bool], device: &Device) -> Result<Maps, NetworkError> {
        let answer = [Stage::RegistrationRefinement];
        let stages = self.infer_at(&[picture], device, &answer, Some(seen)).await?;
        let nothing = || Maps::empty(picture.width(), picture.height());
        Ok(stages.into_iter().flatten().next().unwrap_or_else(nothing))
    }

    /// Estimates the maps of one picture at each of [`Network::stages`]; those of the last are the maps of [`Network::infer`].
    ///
    /// The compact network's mask does not depend on the stage. That of the paper's network is where the depth of the
    /// same stage says that something is seen.
    ///
    /// # Errors
    /// As [`Network::infer`].
    pub async fn infer_stages(&self, picture: &Picture, device: &Device) -> Result<Vec<(Stage, Maps)>, NetworkError> {
        let stages = self.stages();
        let maps = self.infer_at(&[picture], device, stages, None).await?;
        Ok(stages.iter().copied().zip(maps.into_iter().flatten()).collect())
    }

    /// As [`Network::infer_stages`], at the pixels of `seen` and nowhere else, see [`Network::infer_where`].
    ///
    /// # Errors
    /// As [`Network::infer_where`].
    pub async fn infer_stages_where(
        &self,
        picture: &Picture,
        seen: &[bool],
        device: &Device,
    ) -> Result<Vec<(Stage, Maps)>, NetworkError> {
        let stages = self.stages();
        let maps = self.infer_at(&[picture], device, stages, Some(seen)).await?;
        Ok(stages.iter().copied().zip(maps.into_iter().flatten()).collect())
    }

    /// Maps of each picture at each of `stages`, of one pass through the network; at the pixels of `seen` if given, else
    /// in the network's mask.
    async fn infer_at(
        &self,
        pictures: &[&Picture],
        device: &Device,
        stages: &[Stage],
        seen: Option<&[bool]>,
    ) -> Result<Vec<Vec<Maps>>, NetworkError> {
        let Some(first) = pictures.first() else {
            return Ok(Vec::new());
        };
        if let Some(seen) = seen {
            check_size((seen.len(), 1), (first.size().area(), 1))?;
        }
        let range = self.config().depth_range;
        let mut read = Vec::new();
        match self {
            Self::Compact(network) => {
                let output = network.forward(images_to_tensor(pictures, device));
                let [n, _, h, w] = output.main.dims();
                for stage in stages {
                    let (main, refined) = (output.main.clone(), output.refined.clone());
                    let cells = match stage {
                        Stage::Main => main,
                        Stage::DepthRefinement => {
                            let registration = main.slice([0..n, 0..2, 0..h, 0..w]);
                            Tensor::cat(vec![registration, refined.slice([0..n, 2..3, 0..h, 0..w])], 1)
                        }
                        Stage::RegistrationRefinement => refined,
                    };
                    let output_maps = Tensor::cat(vec![network.upsample(cells), output.mask.clone()], 1);
                    read.push(read_maps(output_maps, first, seen, |d| range.depth_mm(d)).await?);
                }
            }
            _ => {
                let maps = self.forward_maps(pictures_to_tensor(pictures, device));
                for stage in stages {
                    let NetworkMaps {
                        main_depth,
                        main_registration,
                        depth,
                        registration,
                        mask_logits,
                    } = maps.clone();
                    let channels = match stage {
                        Stage::Main => {
                            let mask = NetworkMaps::mask_logits_of_depth(main_depth.clone());
                            vec![main_registration, main_depth, mask]
                        }
                        Stage::DepthRefinement => vec![main_registration, depth, mask_logits],
                        Stage::RegistrationRefinement => vec![registration, depth, mask_logits],
                    };
                    let output_maps = Tensor::cat(channels, 1);
                    // Inside is above half of the nearest depth and the -1 outside: what is inside is nowhere nearer than near.
                    let depth_mm = |d| range.depth_mm_linear(d).max(range.near_mm);
                    read.push(read_maps(output_maps, first, seen, depth_mm).await?);
                }
            }
        }
        Ok(read)
    }
}

/// The maps of each image of what a network says, [N, 4, H, W]: u, v, a measure of depth, the mask's logit. They
/// are cut to the size of `picture` and hold the pixels of `seen`, else those of the mask.
async fn read_maps(
    output: Tensor<4>,
    picture: &Picture,
    seen: Option<&[bool]>,
    depth_mm: impl Fn(f64) -> f64,
) -> Result<Vec<Maps>, NetworkError> {
    let [n, _, rows, columns] = output.dims();
    let data = output
        .into_data_async()
        .await
        .map_err(|error| NetworkError::Execution {
            reason: format!("{error:?}"),
        })?;
    let values = data.try_to_vec::<f32>().map_err(|error| NetworkError::Execution {
        reason: format!("{error:?}"),
    })?;
    let (width, height) = (picture.width(), picture.height());
    let plane = rows * columns;
    let maps = (0..n).map(|frame| {
        let frame = &values[frame * 4 * plane..(frame + 1) * 4 * plane];
        let mut maps = Maps::empty(width, height);
        for y in 0..height {
            for x in 0..width {
                let (at, pixel) = (y * columns + x, y * width + x);
                let inside = seen.map_or(frame[3 * plane + at] >= 0.0, |seen| {
                    seen.get(pixel).is_some_and(|&seen| seen)
                });
                if inside {
                    let depth = depth_mm(f64::from(frame[2 * plane + at])) as f32;
                    maps.set(pixel, depth, [frame[at], frame[plane + at]]);
                }
            }
        }
        maps
    });
    Ok(maps.collect())
}
