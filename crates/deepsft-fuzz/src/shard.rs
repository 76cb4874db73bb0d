//! Data sets: shards and their description.

use crate::files::{join, split, with_folder};
use crate::png;
use crate::{picture, template};
use anyhow::{Context, Result};
use deepsft_formats::{
    DatasetDescription, DatasetFolder, IndexedShards, Sample, SampleRecord, ShardReader, write_shard,
};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Camera, Maps};
use serde_json::json;

/// Endings of a sample's entries.
const PARTS: [&str; 4] = ["rgb.png", "depth.png", "uv.png", "json"];

/// Bytes of a block of a tar archive, and where a header has the size and the checksum.
const BLOCK: usize = 512;
const SIZE: std::ops::Range<usize> = 124..136;
const CHECKSUM: std::ops::Range<usize> = 148..156;

/// A shard as it is; the descriptions of a data set in two parts; or the four entries of each sample.
pub(crate) fn read(input: &[u8]) -> Result<()> {
    match split(input).as_slice() {
        [shard] => read_shard(&sealed(shard)),
        [one, other] => read_descriptions(one, other),
        entries => read_shard(&archive(entries)?),
    }
}

fn read_descriptions(one: &[u8], other: &[u8]) -> Result<()> {
    let files = [("part-1-of-2/dataset.json", one), ("part-2-of-2/dataset.json", other)];
    with_folder(files, |folder| {
        let set = DatasetFolder::open(folder)?;
        let description = set.description();
        let again = DatasetDescription::from_json(&description.to_json()?);
        assert!(again.is_ok(), "what was written cannot be read");
        let [template, _] = template::small()?;
        let _ = description.check_template(&template);
        // There are none.
        let _ = set.check_shards();
        Ok(())
    })
}

/// Reads a shard in order, and out of order: both give the same.
fn read_shard(shard: &[u8]) -> Result<()> {
    let in_order: Result<Vec<SampleRecord>, _> = ShardReader::new(shard).records().and_then(Iterator::collect);
    let in_order = in_order?;
    let first = in_order.first().context("there is no sample in it")?;
    with_folder([("shard-000000.tar", shard)], |folder| {
        let mut shards = IndexedShards::new(first.sample.camera);
        let count = shards.add_described(folder.join("shard-000000.tar"), first.seed, first.index)?;
        assert_eq!(count, in_order.len() as u64, "samples out of order");
        for (number, expected) in (0..).zip(&in_order) {
            // Another camera or another number is refused.
            if let Ok(record) = shards.record(number) {
                assert_eq!(record, *expected);
            }
        }
        for record in &in_order {
            let again = record.encode();
            assert!(again.is_ok(), "a sample that was read cannot be written: {again:?}");
        }
        Ok(())
    })
}

/// The shard with the right checksum in every header.
fn sealed(shard: &[u8]) -> Vec<u8> {
    let mut shard = shard.to_vec();
    let mut at = 0;
    while let Some(header) = shard.get_mut(at..at + BLOCK) {
        if header.iter().all(|&byte| byte == 0) {
            break;
        }
        header[CHECKSUM].fill(b' ');
        let sum: u32 = header.iter().map(|&byte| u32::from(byte)).sum();
        header[CHECKSUM].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
        let size = String::from_utf8_lossy(&header[SIZE]).into_owned();
        let size = usize::from_str_radix(size.trim_matches(['\0', ' ']), 8).unwrap_or(0);
        at = at
            .saturating_add(BLOCK)
            .saturating_add(size.min(shard.len()).next_multiple_of(BLOCK));
    }
    shard
}

/// The shard of these entries, four of each sample.
fn archive(entries: &[Vec<u8>]) -> Result<Vec<u8>> {
    let mut archive = tar::Builder::new(Vec::new());
    for (number, content) in entries.iter().enumerate() {
        let mut header = tar::Header::new_ustar();
        header.set_size(content.len() as u64);
        header.set_mode(0o644);
        let name = format!("{:06}.{}", number / PARTS.len(), PARTS[number % PARTS.len()]);
        archive.append_data(&mut header, name, content.as_slice())?;
    }
    Ok(archive.into_inner()?)
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    let camera = Camera::pinhole((5, 4), DVec2::new(5.0, 5.0), DVec2::new(2.5, 2.0))?;
    let mut truth = Maps::empty(5, 4);
    truth.set(7, 321.5, [0.25, 0.75]);
    let vertices = vec![DVec3::new(1.0, 2.0, 321.5); 2];
    let sample = Sample::new(picture::small(5, 4), truth, vertices, camera, DVec3::NEG_Z);
    let records = [0, 1].map(|index| SampleRecord {
        seed: 5,
        index,
        sample: sample.clone(),
    });
    let mut shard = Vec::new();
    write_shard(&mut shard, records[..1].iter().cloned())?;
    let mut entries = Vec::new();
    let mut reader = tar::Archive::new(shard.as_slice());
    for entry in reader.entries()? {
        let mut content = Vec::new();
        std::io::Read::read_to_end(&mut entry?, &mut content)?;
        entries.push(content);
    }
    let json = entries.last().context("no entries")?.clone();
    // The same with pixels that mutations change: no object, one object.
    let rows = |bytes: usize| -> Vec<u8> { (0..4).flat_map(|_| [&[0], &vec![0; bytes][..]].concat()).collect() };
    let image = png::stored([5, 4], [8, 2, 0], &[], &rows(15));
    let (mut depth, mut uv) = (rows(10), rows(30));
    depth[11 + 1 + 4..][..2].copy_from_slice(&3215_u16.to_be_bytes());
    uv[31 + 1 + 12..][..6].copy_from_slice(&[0x40, 0, 0xc0, 0, 0xff, 0xff]);
    let depth = png::stored([5, 4], [16, 0, 0], &[], &depth);
    let uv = png::stored([5, 4], [16, 2, 0], &[], &uv);
    let next = String::from_utf8_lossy(&json)
        .replace("\"index\":0", "\"index\":1")
        .into_bytes();
    let [template, _] = template::small()?;
    let mut description = DatasetDescription::new(&template, json!({"a": 1}), 5, 3, vec!["shard-000000.tar".into()]);
    description.shard_bytes = vec![7];
    description.shard_sha256 = vec!["00".into()];
    let mut follows = description.clone();
    follows.first = 3;
    let entries: Vec<&[u8]> = entries.iter().map(Vec::as_slice).collect();
    Ok(vec![
        shard,
        join(&entries),
        join(&[&image, &depth, &uv, &json, entries[0], entries[1], entries[2], &next]),
        join(&[description.to_json()?.as_bytes(), follows.to_json()?.as_bytes()]),
    ])
}
