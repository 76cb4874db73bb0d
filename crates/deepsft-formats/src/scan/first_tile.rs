//! The texture coordinates of a file as they are: within the unit square, or moved there by whole tiles.

use super::surface::Surface;
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{DisjointSets, Picture};
use std::collections::HashMap;

/// How far texture coordinates may pass the border of a texture and be moved onto it, texels; but no less and no more
/// than these fractions of the texture. Programs place charts up to the border and round.
const BORDER_TEXELS: f64 = 2.0;
const BORDER_FRACTIONS: [f64; 2] = [0.002, 0.01];

/// Moves each chart by whole tiles into the unit square, and what passes its border by a hair onto it. Gives the texture coordinates of all
/// vertices and the longest way of the latter; or why the texture is repeated within a chart.
pub(super) fn first_tile(surface: &Surface, textures: &[Picture]) -> Result<(Vec<DVec2>, f64), String> {
    let [least, most] = BORDER_FRACTIONS.map(DVec2::splat);
    let mut moved: f64 = 0.0;
    let mut charts = DisjointSets::new(surface.vertices.len());
    for &[a, b, c] in &surface.faces {
        charts.join(a, b);
        charts.join(a, c);
    }
    let mut bounds: HashMap<usize, (DVec2, DVec2)> = HashMap::new();
    for (vertex, at) in surface.vertices.iter().enumerate() {
        let (low, high) = bounds.entry(charts.first(vertex)).or_insert((at.uv, at.uv));
        (*low, *high) = (low.min(at.uv), high.max(at.uv));
    }
    let mut placed = Vec::with_capacity(surface.vertices.len());
    for (vertex, at) in surface.vertices.iter().enumerate() {
        let texture = surface.texture_of(at).and_then(|number| textures.get(number));
        let texels = texture.map_or(DVec2::ONE, |texture| texture.size().as_dvec2());
        let hair = (BORDER_TEXELS / texels).clamp(least, most);
        let (low, high) = bounds[&charts.first(vertex)];
        let fits = |tile: DVec2| (low - tile).cmpge(-hair) & (high - tile).cmple(DVec2::ONE + hair);
        // Its own tile, or the next where it begins a hair before that.
        let tile = DVec2::select(fits(low.floor()), low.floor(), (low + hair).floor());
        if !fits(tile).all() {
            return Err(format!(
                "its texture is repeated (u from {:.3} to {:.3}, v from {:.3} to {:.3})",
                low.x,
                high.x,
                1.0 - high.y,
                1.0 - low.y
            ));
        }
        let uv = at.uv - tile;
        let inside = uv.clamp(DVec2::ZERO, DVec2::ONE);
        moved = moved.max((uv - inside).abs().max_element());
        placed.push(inside);
    }
    Ok((placed, moved))
}
