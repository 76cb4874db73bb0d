//! Whether the image shows the object where a mesh lies.

/// Least fraction of the visible print that the image confirms, in the canonical image and in a close-up: of a wrong print a close-up
/// confirms less.
const MIN_EXPLAINED: f64 = 0.4;
const MIN_EXPLAINED_CLOSE_UP: f64 = 0.2;

/// Least [`Verdict::detail`] of a close-up: with less it shows nothing that the canonical image does not.
pub(crate) const CLOSE_UP_DETAIL: f64 = 1.25;

/// Ambiguity from which the image must confirm [`MIN_EXPLAINED_IF_AMBIGUOUS`] of the print: a sheet one row off shows much that is
/// right. From [`MAX_AMBIGUITY`] on nothing is found. A ruled form that was filled in has 0.4 to 0.8 where it lies right, with a third to two
/// thirds explained; 96 frames of repetitive prints are found alike with 0.5 here.
const AMBIGUOUS: f64 = 0.7;
const MIN_EXPLAINED_IF_AMBIGUOUS: f64 = 0.7;
const MAX_AMBIGUITY: f64 = 0.94;

/// Least explained fraction times confirmed pixels of the canonical image: a large sheet has to show less of itself than a small one. On frames with
/// another print the product has reached 1,800, on a nearly black one 2,300; of right fits one in a hundred has less than 2,500.
const MIN_EVIDENCE_PX: f64 = 2500.0;

/// Correlation above which the evidence counts for more, in the same measure. Of what fits confirmed by mistake 0.48 was the most; the corner of
/// a card that is read at 0.9 is enough.
const CLEAR_CORRELATION: f64 = 0.52;

/// Correlation from which the pixels of the close-up count and not those of the canonical image: a far sheet is read there. Of 48 fits to other
/// prints in images of 1280 and 1920 columns the clearest had 0.59.
const READ_CORRELATION: f64 = 0.65;

/// The verdict of an image on a mesh: how far it shows the print where the mesh puts it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Verdict {
    /// Correlation of image and visible print, both locally normalised, 0 to 1.
    pub correlation: f64,
    /// Fraction of the visible print with contrast that the image confirms.
    pub explained: f64,
    /// Pixels of the canonical image that confirm the mesh, about.
    pub confirmed_px: f64,
    /// Pixels of the image that was compared along the side of a pixel of the canonical image: 1 for that image itself, more for a
    /// close-up.
    pub detail: f64,
    /// What the image confirms of the next best place where the print looks alike, as a fraction of this one. Near 1 nothing tells
    /// the two apart; 1 also where the fit was too bad to be tried elsewhere. `None` for a print that looks like itself nowhere
    /// else, for a mesh that started from a network's maps or from the last frame, and in close-ups where an untried print looks like
    /// itself only when it is blurred.
    pub ambiguity: Option<f64>,
}

impl Verdict {
    /// Whether the object is found: the one rule for all finders.
    pub fn is_found(&self) -> bool {
        let is_clear = match self.ambiguity {
            Some(ambiguity) if ambiguity >= AMBIGUOUS => {
                self.explained >= MIN_EXPLAINED_IF_AMBIGUOUS && ambiguity < MAX_AMBIGUITY
            }
            _ if self.detail >= CLOSE_UP_DETAIL => self.explained >= MIN_EXPLAINED_CLOSE_UP,
            _ => self.explained >= MIN_EXPLAINED,
        };
        let compared = if self.correlation >= READ_CORRELATION {
            self.detail.powi(2)
        } else {
            1.0
        };
        let clearness = (self.correlation / CLEAR_CORRELATION).max(1.0);
        let evidence_px = self.explained * self.confirmed_px * compared * clearness;
        is_clear && evidence_px >= MIN_EVIDENCE_PX
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_a_large_print_is_enough_unless_the_next_row_is_as_likely_or_the_print_is_small() {
        let found = |[correlation, explained, confirmed_px, detail]: [f64; 4], ambiguity: Option<f64>| {
            let verdict = Verdict {
                correlation,
                explained,
                confirmed_px,
                detail,
                ambiguity,
            };
            verdict.is_found()
        };
        let of_print = |explained: f64, ambiguity: Option<f64>| found([0.8, explained, 2e4, 1.0], ambiguity);
        assert!(of_print(0.5, None) && of_print(0.5, Some(0.3)));
        assert!(!of_print(0.3, None) && !of_print(0.5, Some(0.8)));
        // A form that was filled in.
        assert!(of_print(0.45, Some(0.65)));
        assert!(of_print(0.9, Some(0.8)) && !of_print(0.9, Some(0.96)));
        assert!(!found([0.8, 0.9, 1500.0, 1.0], None) && !Verdict::default().is_found());
        // Close-ups.
        assert!(found([0.6, 0.25, 2e4, 2.0], None) && !found([0.6, 0.15, 2e4, 2.0], None));
        // A far sheet that is read in detail, or only so so.
        assert!(found([0.85, 0.95, 400.0, 4.0], None) && !found([0.6, 0.95, 1200.0, 4.0], None));
        assert!(!found([0.85, 0.95, 400.0, 1.0], None));
        // A corner of a card that is read well, and a larger part of a sheet that resembles what is seen.
        assert!(found([0.92, 0.99, 1950.0, 2.0], None) && !found([0.45, 0.8, 3000.0, 2.0], None));
    }
}
