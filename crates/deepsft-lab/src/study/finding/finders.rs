//! What looks for a print.

use super::prints::Print;
use crate::measuring::Stopwatch;
use anyhow::Result;
use deepsft::{DescriptorFinder, Estimator, Finder, FinderKind, SharedDescriptorNetwork, View};
use deepsft_finding::FeatureFinder;
use deepsft_geometry::Camera;
use deepsft_geometry::fitting::Start;

/// A way to find prints: a row of the table.
pub enum Way {
    /// Features of the print.
    Features,
    /// The network that describes any picture.
    Descriptors(SharedDescriptorNetwork),
    /// The network of a model, whose template is the only print.
    Network(Box<Estimator>),
}

/// What a finder found.
pub struct Found {
    /// Where it sees the print, for the canonical camera; `None` when it did not find it.
    pub start: Option<Start>,
    /// Processor time on one thread: what does not depend on the print, and the rest.
    pub features_ms: f64,
    pub find_ms: f64,
}

impl Way {
    pub fn kind(&self) -> FinderKind {
        match self {
            Self::Features => FinderKind::Features,
            Self::Descriptors(_) => FinderKind::Descriptors,
            Self::Network(_) => FinderKind::Network,
        }
    }

    /// What finds `print` in this way.
    pub fn finder(&self, print: &Print) -> Result<Finder> {
        Ok(match self {
            Self::Features => Finder::Features(Box::new(FeatureFinder::new(print.template.clone())?)),
            Self::Descriptors(network) => {
                Finder::Descriptors(Box::new(DescriptorFinder::new(network, &print.template)?))
            }
            Self::Network(network) => Finder::Network(network.clone()),
        })
    }

    /// Looks with `finder`, which is of this way.
    pub fn find(&self, finder: &mut Finder, mut view: View<'_>, canonical: &Camera) -> Result<Found> {
        let start = Stopwatch::start();
        match self {
            Self::Network(_) => drop(view.canonical(canonical)?),
            _ => drop(view.features()?),
        }
        let features_ms = start.ms();
        let start = Stopwatch::start();
        let found = pollster::block_on(finder.find(&mut view, canonical))?;
        Ok(Found {
            start: found.map(|(start, _)| start),
            features_ms,
            find_ms: start.ms(),
        })
    }
}
