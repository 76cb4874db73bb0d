//! What looks for a print.

use super::prints::Print;
use crate::measuring::Stopwatch;
use anyhow::Result;
use deepsft::{DescriptorFinder, Estimator, Finder, SharedDescriptorNetwork, View};
use deepsft_finding::FeatureFinder;
use deepsft_geometry::Camera;
use deepsft_geometry::fitting::Start;

/// The finders that are studied beside features, each a row of the table.
pub struct Others {
    /// The network of a model, whose template is the only print.
    pub network: Option<Estimator>,
    /// The network that describes any picture.
    pub descriptors: Option<SharedDescriptorNetwork>,
}

impl Others {
    /// Features of `print`, and what else finds it.
    pub fn finders(&self, Print { template, .. }: &Print) -> Result<Vec<Finder>> {
        let mut finders = vec![Finder::Features(Box::new(FeatureFinder::new(template.clone())?))];
        finders.extend(self.network.clone().map(Box::new).map(Finder::Network));
        if let Some(network) = &self.descriptors {
            finders.push(Finder::Descriptors(Box::new(DescriptorFinder::new(network, template)?)));
        }
        Ok(finders)
    }
}

/// Where a finder sees the print, for the canonical camera, and its processor time on one thread (ms): for what does not depend on the
/// print, and for the rest.
pub fn find(finder: &mut Finder, mut view: View<'_>, canonical: &Camera) -> Result<(Option<Start>, [f64; 2])> {
    let start = Stopwatch::start();
    match finder {
        Finder::Network(_) => drop(view.canonical(canonical)?),
        _ => drop(view.features()?),
    }
    let features_ms = start.ms();
    let start = Stopwatch::start();
    let found = pollster::block_on(finder.find(&mut view, canonical))?;
    Ok((found.map(|(start, _)| start), [features_ms, start.ms()]))
}
