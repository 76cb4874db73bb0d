//! The files of a checkpoint that burn reads, looked at before it does: it takes them for its own, and panics at numbers of
//! another kind and at an optimiser of other weights.

use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{DType, Tensor};
use burn_pack::Reader;
use deepsft_network::Network;
use std::collections::BTreeMap;
use std::path::Path;

/// Ending of the numbers that say how many axes a weight has.
const RANK: &str = ".__rank";

/// Checks that the file holds arrays of floats and nothing else. Their names and shapes are for burn to check.
///
/// # Errors
/// A sentence that says what is wrong with it.
pub(super) fn check_network(path: &Path) -> Result<(), String> {
    let reader = Reader::from_file_exact(path).map_err(|error| error.to_string())?;
    for tensor in reader.into_tensors().map_err(|error| error.to_string())? {
        let (name, kind, ..) = tensor.into_parts().map_err(|error| error.to_string())?;
        if !is_float(kind) {
            return Err(format!("{name} holds {kind:?}, expected F16, BF16 or F32"));
        }
    }
    Ok(())
}

fn is_float(kind: DType) -> bool {
    matches!(kind, DType::F32 | DType::F16 | DType::BF16)
}

/// Checks that the file is of an optimiser of `network`'s weights: every array in it belongs to a weight, whose number its
/// name begins with, and has its shape.
///
/// # Errors
/// A sentence that says what is wrong with it.
pub(super) fn check_optimizer(path: &Path, network: &Network) -> Result<(), String> {
    let mut weights = Shapes::default();
    network.visit(&mut weights);
    let reader = Reader::from_file_exact(path).map_err(|error| error.to_string())?;
    let foreign = |name: &str| Err(format!("{name} belongs to no weight of the network"));
    for (name, rank) in reader.scalars() {
        let Some(id) = name.strip_suffix(RANK) else { continue };
        let weight = id.parse().ok().and_then(|id| weights.0.get(&id));
        if weight.is_none_or(|shape| usize::try_from(*rank) != Ok(shape.len())) {
            return foreign(name);
        }
    }
    for tensor in reader.into_tensors().map_err(|error| error.to_string())? {
        let (name, kind, shape, id, _) = tensor.into_parts().map_err(|error| error.to_string())?;
        let Some((id, weight)) = id.and_then(|id| weights.0.get_key_value(&id)) else {
            return foreign(&name);
        };
        if !name.starts_with(&format!("{id}.")) {
            return foreign(&name);
        }
        if shape.to_vec() != *weight || !is_float(kind) {
            return Err(format!(
                "{name} is {kind:?} of the shape {:?}, its weight has {weight:?}",
                shape.to_vec()
            ));
        }
    }
    Ok(())
}

/// The shapes of weights by burn's numbers of them.
#[derive(Default)]
struct Shapes(BTreeMap<u64, Vec<usize>>);

impl ModuleVisitor for Shapes {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        self.0.insert(param.id.val(), param.val().dims().to_vec());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::{Bytes, Device};
    use burn_pack::{Scalar, Tensor as Packed, Writer};

    /// The first weight of a network: its number and its shape.
    fn first(network: &Network) -> (u64, Vec<usize>) {
        let mut weights = Shapes::default();
        network.visit(&mut weights);
        weights.0.pop_first().unwrap()
    }

    #[test]
    fn a_file_of_other_weights_is_refused_in_words() {
        let camera = deepsft_geometry::training_camera();
        let config = deepsft::NetworkConfig::compact([297.0, 210.0], &camera);
        let network = Network::new(&config, &Device::flex());
        let (id, shape) = first(&network);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("optimizer.bpk");
        let array = |name: &str, id: Option<u64>, shape: &[usize], kind: DType| {
            let bytes = vec![0; shape.iter().product::<usize>() * kind.size()];
            let array = Packed::new(name.to_owned(), kind, shape.to_vec(), id, Bytes::from_bytes_vec(bytes));
            Writer::new(vec![array])
        };
        let said = |writer: Writer| {
            std::fs::write(&path, &writer.into_bytes().unwrap()[..]).unwrap();
            check_optimizer(&path, &network).map_or_else(|reason| reason, |()| String::new())
        };
        let (own, rank) = (format!("{id}.moment"), format!("{id}.__rank"));
        let whole = || array(&own, Some(id), &shape, DType::F32);
        assert_eq!(said(whole().with_scalar(&rank, Scalar::from(shape.len()))), "");
        // In each of these burn panics.
        for (writer, part) in [
            (array(&own, None, &shape, DType::F32), "belongs to no weight"),
            (array("7.moment", Some(7), &shape, DType::F32), "belongs to no weight"),
            (array("7.moment", Some(id), &shape, DType::F32), "belongs to no weight"),
            (array(&own, Some(id), &[5], DType::F32), "its weight has"),
            (array(&own, Some(id), &shape, DType::U8), "U8"),
            (
                whole().with_scalar(&rank, Scalar::from(9_usize)),
                "belongs to no weight",
            ),
            (
                whole().with_scalar("7.__rank", Scalar::from(1_usize)),
                "belongs to no weight",
            ),
        ] {
            let said = said(writer);
            assert!(said.contains(part), "{said}");
        }
        std::fs::write(&path, b"cut").unwrap();
        assert!(!check_optimizer(&path, &network).unwrap_err().is_empty());
    }

    #[test]
    fn a_network_of_whole_numbers_is_refused_in_words() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("network.bpk");
        for (kind, refused) in [(DType::BF16, false), (DType::U8, true), (DType::I32, true)] {
            let bytes = Bytes::from_bytes_vec(vec![0; 2 * kind.size()]);
            let array = Packed::new("main.offset.bias".to_owned(), kind, vec![2], Some(3), bytes);
            std::fs::write(&path, &Writer::new(vec![array]).into_bytes().unwrap()[..]).unwrap();
            let checked = check_network(&path);
            assert_eq!(checked.is_err(), refused, "{kind:?}");
            assert!(checked.err().is_none_or(|reason| reason.contains("main.offset.bias")));
        }
    }
}
