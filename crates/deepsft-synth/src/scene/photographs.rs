//! The user's photographs as backgrounds and as art of other sheets: decoded when a scene needs one, and kept within a
//! bounded memory.

use crate::error::SynthError;
use crate::random::{Stream, generator, mix};
use crate::render::Texture;
use crate::scene::artwork::photograph_sheet;
use deepsft_formats::{FormatError, decode_picture, read_error, sha256};
use deepsft_geometry::Picture;
use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};
use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Memory for photographs that stay decoded, bytes: about 80 of a camera's, which take 6.5 MB each. Others are decoded
/// again each time a scene shows them.
const CACHE_BYTES: usize = 512 << 20;

/// Photographs are halved until their long side is at most this, pixels.
const LONGEST_SIDE: usize = 1000;

/// Sheets with other art that are made from each photograph.
pub(crate) const SHEETS_PER_PHOTOGRAPH: usize = 2;

/// A photograph as scenes use it.
#[derive(Clone, Debug)]
pub(crate) struct Photograph {
    pub(crate) background: Arc<Texture>,
    pub(crate) sheets: [Arc<Texture>; SHEETS_PER_PHOTOGRAPH],
}

/// Photograph files in order.
#[derive(Debug)]
pub(crate) struct Photographs {
    /// Each with the SHA-256 of its bytes.
    files: Vec<(PathBuf, String)>,
    /// The photographs used last, with their numbers; the latest at the end.
    cache: Mutex<VecDeque<(usize, Photograph)>>,
    cache_bytes: usize,
    /// The first file that could not be read again, and why.
    failure: OnceLock<(PathBuf, String)>,
}

impl Photographs {
    /// Decodes every file once, to refuse what is no photograph before any sample is made.
    pub(crate) fn open(files: Vec<PathBuf>) -> Result<Self, SynthError> {
        Self::with_cache(files, CACHE_BYTES)
    }

    fn with_cache(files: Vec<PathBuf>, cache_bytes: usize) -> Result<Self, SynthError> {
        let mut photographs = Self {
            files: Vec::new(),
            cache: Mutex::default(),
            cache_bytes,
            failure: OnceLock::new(),
        };
        let hashes: Result<Vec<String>, SynthError> = (files.par_iter().enumerate())
            .map(|(number, path)| {
                let (picture, hash) = read(path).map_err(|reason| refused(path, &reason))?;
                photographs.remember(number, Photograph::new(number, picture));
                Ok(hash)
            })
            .collect();
        photographs.files = files.iter().cloned().zip(hashes?).collect();
        Ok(photographs)
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.files.len()
    }

    /// The SHA-256 of each file.
    pub(crate) fn hashes(&self) -> impl Iterator<Item = &str> {
        self.files.iter().map(|(_, hash)| hash.as_str())
    }

    /// Photograph `number`; `None` when its file has gone or changed, which [`Photographs::check`] then reports.
    pub(crate) fn get(&self, number: usize) -> Option<Photograph> {
        {
            let mut cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(place) = cache.iter().position(|(there, _)| *there == number) {
                let entry = cache.remove(place)?;
                let photograph = entry.1.clone();
                cache.push_back(entry);
                return Some(photograph);
            }
        }
        let (path, hash) = &self.files[number];
        let read = read(path).and_then(|(picture, now)| match now == *hash {
            true => Ok(picture),
            false => Err("the photograph changed while samples were made of it".to_owned()),
        });
        match read {
            Ok(picture) => {
                let photograph = Photograph::new(number, picture);
                self.remember(number, photograph.clone());
                Some(photograph)
            }
            Err(reason) => {
                self.failure.get_or_init(|| (path.clone(), reason));
                None
            }
        }
    }

    /// Fails when a file could not be read again.
    pub(crate) fn check(&self) -> Result<(), SynthError> {
        match self.failure.get() {
            Some((path, reason)) => Err(refused(path, reason)),
            None => Ok(()),
        }
    }

    /// Keeps a photograph, and lets those go that were used least lately when there are too many.
    fn remember(&self, number: usize, photograph: Photograph) {
        let mut cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        cache.retain(|(there, _)| *there != number);
        cache.push_back((number, photograph));
        let mut bytes: usize = cache.iter().map(|(_, photograph)| photograph.bytes()).sum();
        while bytes > self.cache_bytes
            && let Some((_, oldest)) = cache.pop_front()
        {
            bytes -= oldest.bytes();
        }
    }
}

impl Photograph {
    fn new(number: usize, picture: Picture) -> Self {
        let mut rng = generator(mix(number as u64), 0, Stream::Pool);
        let sheets = std::array::from_fn(|_| Arc::new(Texture::new(&photograph_sheet(&picture, &mut rng))));
        let mut picture = picture;
        while picture.width().max(picture.height()) > LONGEST_SIDE {
            picture = picture.halved();
        }
        Self {
            background: Arc::new(Texture::new(&picture)),
            sheets,
        }
    }

    fn bytes(&self) -> usize {
        self.background.bytes() + self.sheets.iter().map(|sheet| sheet.bytes()).sum::<usize>()
    }
}

/// The picture in a file and the SHA-256 of its bytes.
fn read(path: &Path) -> Result<(Picture, String), String> {
    let bytes = fs::read(path).map_err(|error| read_error(error).to_string())?;
    let picture = decode_picture(&bytes).map_err(|error| error.to_string())?;
    Ok((picture, sha256(&bytes)))
}

fn refused(path: &Path, reason: &str) -> SynthError {
    FormatError::unusable("image", path, reason).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_formats::encode_png;

    fn folder(count: u8) -> (tempfile::TempDir, Vec<PathBuf>) {
        let folder = tempfile::tempdir().unwrap();
        let files = (0..count).map(|k| {
            let picture = Picture::from_fn(60 + usize::from(k), 40, |x, y| [4 * x as u8, 6 * y as u8, 50 * k]);
            let path = folder.path().join(format!("{k}.png"));
            fs::write(&path, encode_png(&picture).unwrap()).unwrap();
            path
        });
        let files = files.collect();
        (folder, files)
    }

    #[test]
    fn what_the_cache_lets_go_is_decoded_again_as_it_was() {
        let (_folder, files) = folder(4);
        let all = Photographs::open(files.clone()).unwrap();
        let one = all.get(0).unwrap().bytes();
        // Room for two of nearly the same size, never for three.
        let few = Photographs::with_cache(files, 5 * one / 2).unwrap();
        for number in [0, 3, 1, 0, 2, 2, 3, 0] {
            let (kept, again) = (all.get(number).unwrap(), few.get(number).unwrap());
            assert_eq!(format!("{kept:?}"), format!("{again:?}"), "{number}");
            let cache = few.cache.lock().unwrap();
            assert!(cache.len() <= 2, "{}", cache.len());
            assert_eq!(cache.back().unwrap().0, number);
        }
        assert_eq!(all.cache.lock().unwrap().len(), 4);
    }

    #[test]
    fn a_photograph_that_went_or_changed_on_the_way_is_reported() {
        let (_folder, files) = folder(2);
        let photographs = Photographs::with_cache(files.clone(), 0).unwrap();
        assert!(photographs.get(0).is_some() && photographs.check().is_ok());
        fs::copy(&files[1], &files[0]).unwrap();
        assert!(photographs.get(0).is_none());
        let error = photographs.check().unwrap_err().to_string();
        assert!(error.contains("changed") && error.contains("0.png"), "{error}");

        let photographs = Photographs::with_cache(files.clone(), 0).unwrap();
        fs::remove_file(&files[1]).unwrap();
        assert!(photographs.get(1).is_none());
        assert!(photographs.check().unwrap_err().to_string().contains("1.png"));
        assert!(Photographs::open(files).is_err());
    }
}
