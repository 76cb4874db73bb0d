//! Data sets as folders: `dataset.json` and its tar shards.

use crate::failure::BlameInput;
use crate::output::atomic::StagedFolder;
use anyhow::{Context, Result, anyhow, bail};
use deepsft_formats::sha256_file;
use deepsft_geometry::{Camera, Template};
use deepsft_synth::{
    DatasetDescription, EdgeLengthHistogram, EdgeLengthSummary, HandleShapeCounts, Sample, SampleRecord, ShardReader,
    write_shard,
};
use std::ffi::OsString;
use std::fs;
use std::io::{BufReader, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{SyncSender, sync_channel};

/// Name of the description in a data set's folder.
pub const DATASET_FILE: &str = "dataset.json";

/// Samples that are read ahead.
const AHEAD: usize = 8;

/// Writes shards of at most `shard_size` records each into `folder`; gives their names.
pub fn write_shards(
    folder: &StagedFolder,
    records: impl Iterator<Item = SampleRecord>,
    shard_size: u64,
) -> Result<Vec<String>> {
    let mut shards = Vec::new();
    let mut records = records.peekable();
    while records.peek().is_some() {
        let name = format!("shard-{:06}.tar", shards.len());
        let path = folder.path().join(&name);
        let file = fs::File::create(&path).with_context(|| format!("could not make {}", path.display()))?;
        let some = records.by_ref().take(shard_size as usize);
        write_shard(BufWriter::new(file), some).with_context(|| format!("could not write {name}"))?;
        shards.push(name);
    }
    Ok(shards)
}

/// Name of the folder of part `part` of `of` in a data set's folder.
pub fn part_name(part: u64, of: u64) -> String {
    format!("part-{part}-of-{of}")
}

/// The folder beside `folder` in which a data set is made that is to stand there.
pub fn unfinished(folder: &Path) -> PathBuf {
    let mut name = folder.file_name().map_or_else(OsString::new, OsString::from);
    name.push(".partial");
    folder.with_file_name(name)
}

/// Reads and checks the description of the data set in `folder`. One that was made in parts is put together, and all of
/// them have to be there.
pub fn open(folder: &Path) -> Result<DatasetDescription> {
    match (folder.join(DATASET_FILE).exists(), parts(folder)) {
        (false, Some(of)) => merged(folder, of).blame("data set", folder),
        (false, None) if unfinished(folder).is_dir() => {
            let what_there_is = unfinished(folder);
            Err(anyhow!(
                "it is not finished, what there is of it is in {}: give `deepsft synth` the same command again",
                what_there_is.display()
            ))
            .blame("data set", folder)
        }
        _ => open_one(folder),
    }
}

/// Checks that a data set is of `template`, see [`DatasetDescription::is_of`].
pub fn check_template(description: &DatasetDescription, template: &Template) -> Result<()> {
    let [width, height] = description.template_size_mm;
    let size = template.size_mm();
    if [width, height] != size.to_array() {
        bail!(
            "it is of another template: {width} x {height} mm, not {} x {} mm",
            size.x,
            size.y
        );
    }
    if !description.is_of(template) {
        bail!("it is of another template: one of this size, with another texture or mesh");
    }
    Ok(())
}

/// The number of parts of which there is any in `folder`; of several numbers the largest.
pub fn parts(folder: &Path) -> Option<u64> {
    let names = fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let of = |name: String| -> Option<u64> { name.strip_prefix("part-")?.split_once("-of-")?.1.parse().ok() };
    names.filter_map(of).max()
}

/// The description of a data set of `of` parts.
fn merged(folder: &Path, of: u64) -> Result<DatasetDescription> {
    let mut whole: Option<DatasetDescription> = None;
    let mut changes = EdgeLengthHistogram::default();
    let mut shapes = Some(HandleShapeCounts::default());
    for part in 1..=of {
        let name = part_name(part, of);
        if !folder.join(&name).join(DATASET_FILE).exists() {
            bail!("{name} is not there yet");
        }
        let mut description = open_one(&folder.join(&name))?;
        for shard in &mut description.shards {
            *shard = format!("{name}/{shard}");
        }
        if let Some(summary) = &description.edge_length_change {
            changes.add(&summary.histogram);
        }
        if description.samples > 0 {
            shapes = shapes.zip(description.handle_shapes).map(|(mut sum, counts)| {
                sum.add(&counts);
                sum
            });
        }
        match &mut whole {
            None => whole = Some(description),
            Some(whole) => {
                let follows = description.first == whole.first + whole.samples;
                if (&description.fingerprint, description.seed) != (&whole.fingerprint, whole.seed) || !follows {
                    bail!("{name} is part of another data set than those before it");
                }
                whole.samples += description.samples;
                whole.shards.append(&mut description.shards);
                whole.shard_bytes.append(&mut description.shard_bytes);
                whole.shard_sha256.append(&mut description.shard_sha256);
            }
        }
    }
    let mut whole = whole.context("it has no parts")?;
    if whole.shard_bytes.len() != whole.shards.len() {
        // A part that does not say how large its shards are: nothing is known in order.
        whole.shard_bytes.clear();
    }
    if whole.shard_sha256.len() != whole.shards.len() {
        whole.shard_sha256.clear();
    }
    whole.part = None;
    whole.edge_length_change = Some(EdgeLengthSummary::new(changes));
    // A part that does not say them: of the whole they are not known either.
    whole.handle_shapes = shapes.filter(|shapes| shapes.shapes > 0);
    Ok(whole)
}

/// Checks that the shards of the data set in `folder` are there and, where the description says how large they are,
/// whole.
pub fn check_shards(folder: &Path, description: &DatasetDescription) -> Result<()> {
    for (number, name) in description.shards.iter().enumerate() {
        let path = folder.join(name);
        let wrong = match (fs::metadata(&path), description.shard_bytes.get(number)) {
            (Err(error), _) => error.to_string(),
            (Ok(file), Some(&bytes)) if bytes != file.len() => {
                format!("it has {} bytes and should have {bytes}", file.len())
            }
            _ => continue,
        };
        return Err(anyhow!("{wrong}; put it back, or remove the data set to make it anew")).blame("shard", &path);
    }
    Ok(())
}

/// Checks that the shard `number` of a data set is the one that was described, as far as the description says.
fn check_hash(path: &Path, description: &DatasetDescription, number: usize) -> Result<()> {
    match description.shard_sha256.get(number) {
        Some(expected) if sha256_file(path)? != *expected => {
            bail!("it is not the shard that was written: its SHA-256 differs from the described one")
        }
        _ => Ok(()),
    }
}

/// Checks the content of all shards of the data set in `folder` by their hashes: that takes as long as reading them.
pub fn check_hashes(folder: &Path, description: &DatasetDescription) -> Result<()> {
    description.shards.iter().enumerate().try_for_each(|(number, name)| {
        let path = folder.join(name);
        check_hash(&path, description, number).blame("shard", &path)
    })
}

/// Reads and checks the description in `folder`.
fn open_one(folder: &Path) -> Result<DatasetDescription> {
    let path = folder.join(DATASET_FILE);
    let read = || -> Result<DatasetDescription> {
        let description = DatasetDescription::from_json(&fs::read_to_string(&path)?)?;
        if let Some(name) = description.shards.iter().find(|name| name.contains(['/', '\\'])) {
            bail!("it names a shard outside of its folder: {name:?}");
        }
        Ok(description)
    };
    read().blame("data set", &path)
}

/// The samples of all shards in order, read ahead by a thread. Samples of another camera than `camera`, other samples
/// or fewer than described and shards with another hash are errors; after an error there are no more.
pub fn samples(
    folder: &Path,
    description: &DatasetDescription,
    camera: Camera,
) -> impl Iterator<Item = Result<Sample>> + use<> {
    let (sender, receiver) = sync_channel(AHEAD);
    let paths: Vec<PathBuf> = description.shards.iter().map(|name| folder.join(name)).collect();
    let (folder, description) = (folder.to_path_buf(), description.clone());
    std::thread::spawn(move || {
        let mut count = 0;
        let expected = description.samples;
        for (number, path) in paths.iter().enumerate() {
            let next = description.first + count;
            let sent = check_hash(path, &description, number)
                .and_then(|()| send_shard(path, &camera, (description.seed, next), &sender))
                .blame("shard", path);
            match sent {
                Ok(samples) => count += samples,
                Err(error) => {
                    // Nobody listens when the reader has had enough: then nothing is lost either.
                    let _ = sender.send(Err(error));
                    return;
                }
            }
        }
        if count != expected {
            let short = Err(anyhow!(
                "its shards hold {count} samples, its description says {expected}"
            ));
            let _ = sender.send(short.blame("data set", &folder));
        }
    });
    receiver.into_iter()
}

/// Sends the samples of a shard, which are those of a seed from an index on; gives their number.
fn send_shard(
    path: &Path,
    camera: &Camera,
    (seed, first): (u64, u64),
    sender: &SyncSender<Result<Sample>>,
) -> Result<u64> {
    let mut reader = ShardReader::new(BufReader::new(fs::File::open(path)?));
    let mut count = 0;
    for record in reader.records()? {
        let record = record?;
        record.check_described(seed, first.saturating_add(count))?;
        let SampleRecord { index, sample, .. } = record;
        if sample.camera != *camera {
            bail!("sample {index} was taken by another camera than the one expected");
        }
        count += 1;
        if sender.send(Ok(sample)).is_err() {
            break;
        }
    }
    Ok(count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthesis;
    use deepsft_geometry::{Picture, Template, training_camera};
    use deepsft_synth::SynthConfig;

    fn written(place: &Path, count: u64, described: u64) -> Vec<Sample> {
        let texture = Picture::from_fn(40, 30, |x, y| [6 * x as u8, 8 * y as u8, 90]);
        let template = Template::thin_shell(texture, 200.0, 150.0).unwrap();
        let samples: Vec<Sample> = deepsft_synth::samples(
            synthesis::synthesizer(&template, &synthesis::SynthesisOptions::default()).unwrap(),
            3,
            0..count,
        )
        .collect::<Result<_, _>>()
        .unwrap();
        let records = (0..)
            .zip(samples.clone())
            .map(|(index, sample)| SampleRecord { seed: 3, index, sample });
        let folder = StagedFolder::new(place, &deepsft_formats::FolderKind::DATASET).unwrap();
        let shards = write_shards(&folder, records, 2).unwrap();
        let description =
            DatasetDescription::new(&template, SynthConfig::default().description(), 3, described, shards);
        fs::write(folder.path().join(DATASET_FILE), description.to_json().unwrap()).unwrap();
        folder.commit().unwrap();
        samples
    }

    #[test]
    fn samples_come_back_in_order_over_all_shards() {
        let above = tempfile::tempdir().unwrap();
        let place = above.path().join("set");
        let samples = written(&place, 5, 5);
        let description = open(&place).unwrap();
        assert_eq!(
            description.shards,
            ["shard-000000.tar", "shard-000001.tar", "shard-000002.tar"]
        );
        let read: Vec<Sample> = self::samples(&place, &description, training_camera())
            .map(Result::unwrap)
            .collect();
        assert_eq!(read.len(), 5);
        assert!(
            read.iter()
                .zip(&samples)
                .all(|(read, sample)| read.image == sample.image)
        );
    }

    #[test]
    fn shapes_of_parts_are_added_up_where_all_parts_say_them() {
        let counts = |shapes| HandleShapeCounts {
            shapes,
            weakened: 1,
            at_rest: 0,
        };
        let template = Template::thin_shell(Picture::from_fn(4, 3, |_, _| [9; 3]), 200.0, 150.0).unwrap();
        for (shapes, sum) in [
            ([(4, Some(counts(3))), (4, Some(counts(2)))], Some((5, 2))),
            ([(4, Some(counts(3))), (4, None)], None),
            ([(4, None), (4, Some(counts(3)))], None),
            ([(4, None), (4, None)], None),
            // A part without samples has nothing to say.
            ([(4, Some(counts(3))), (0, None)], Some((3, 1))),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let mut first = 0;
            for (number, (samples, handle_shapes)) in (1..).zip(shapes) {
                let mut part =
                    DatasetDescription::new(&template, SynthConfig::default().description(), 3, samples, Vec::new());
                (part.first, part.handle_shapes) = (first, handle_shapes);
                first += samples;
                let place = folder.path().join(part_name(number, 2));
                fs::create_dir(&place).unwrap();
                fs::write(place.join(DATASET_FILE), part.to_json().unwrap()).unwrap();
            }
            let whole = open(folder.path()).unwrap();
            assert_eq!(
                whole.handle_shapes.map(|all| (all.shapes, all.weakened)),
                sum,
                "{shapes:?}"
            );
        }
    }

    #[test]
    fn a_shard_that_is_cut_and_a_sample_that_is_missing_are_errors() {
        let above = tempfile::tempdir().unwrap();
        let place = above.path().join("set");
        written(&place, 2, 3);
        let description = open(&place).unwrap();
        let last = |camera| samples(&place, &description, camera).last().unwrap().map(|_| ());
        let message = |error: anyhow::Error| crate::failure::message(&error);
        assert!(message(last(training_camera()).unwrap_err()).contains("hold 2 samples, its description says 3"));
        let other = training_camera().resized(960, 540).unwrap();
        assert!(message(last(other).unwrap_err()).contains("another camera"));
        let shard = place.join("shard-000000.tar");
        let bytes = fs::read(&shard).unwrap();
        fs::write(&shard, &bytes[..bytes.len() / 2]).unwrap();
        assert!(message(last(training_camera()).unwrap_err()).contains("shard-000000.tar"));
    }

    #[test]
    fn shards_of_another_seed_or_place_or_content_are_refused() {
        let above = tempfile::tempdir().unwrap();
        let place = above.path().join("set");
        written(&place, 3, 3);
        let description = open(&place).unwrap();
        let message = |description: &DatasetDescription| {
            let last = samples(&place, description, training_camera()).last().unwrap();
            crate::failure::message(&last.err().unwrap())
        };
        let other_seed = DatasetDescription {
            seed: 4,
            ..description.clone()
        };
        assert!(message(&other_seed).contains("sample 0 of seed 3"));
        let mut exchanged = description.clone();
        exchanged.shards.swap(0, 1);
        assert!(message(&exchanged).contains("sample 2 of seed 3"));
        let mut hashed = description.clone();
        let hash = |name: &String| sha256_file(&place.join(name)).unwrap();
        hashed.shard_sha256 = hashed.shards.iter().map(hash).collect();
        check_hashes(&place, &hashed).unwrap();
        assert_eq!(
            samples(&place, &hashed, training_camera()).map(Result::unwrap).count(),
            3
        );
        hashed.shard_sha256[1].replace_range(..1, "x");
        let error = crate::failure::message(&check_hashes(&place, &hashed).unwrap_err());
        assert!(
            error.contains("shard-000001.tar") && error.contains("SHA-256"),
            "{error}"
        );
        assert!(message(&hashed).contains("SHA-256"));
    }

    #[test]
    fn a_foreign_folder_is_no_data_set() {
        let folder = tempfile::tempdir().unwrap();
        let error = open(folder.path()).unwrap_err();
        assert!(crate::failure::message(&error).contains("dataset.json"), "{error}");
    }
}
