//! The toy's shape: rounded limbs blended into one smooth implicit surface.

use deepsft_geometry::glam::{DVec2, DVec3};

/// Radius of the blend between two limbs, mm.
const BLEND_MM: f64 = 9.0;

/// Step of the numerical gradient, mm.
const GRADIENT_STEP_MM: f64 = 0.05;

/// A box that holds the whole toy with some room, mm, template frame.
pub(crate) const BOUNDS_MM: [DVec3; 2] = [DVec3::new(-112.0, -184.0, -64.0), DVec3::new(112.0, 156.0, 68.0)];

/// The limbs, each sewn from pieces of its own. Left and right are the toy's own: its left is +x.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Limb {
    Body,
    Head,
    LeftEar,
    RightEar,
    LeftArm,
    RightArm,
    LeftLeg,
    RightLeg,
    Tail,
}

/// All limbs.
pub(crate) const LIMBS: [Limb; 9] = [
    Limb::Body,
    Limb::Head,
    Limb::LeftEar,
    Limb::RightEar,
    Limb::LeftArm,
    Limb::RightArm,
    Limb::LeftLeg,
    Limb::RightLeg,
    Limb::Tail,
];

impl Limb {
    /// About the distance of `p` from the limb's surface, mm, negative inside.
    pub(crate) fn distance(self, p: DVec3) -> f64 {
        // The right side is the left one mirrored, but for the ears.
        let mirrored = DVec3::new(-p.x, p.y, p.z);
        match self {
            Self::Body => ellipsoid(p - DVec3::new(0.0, 38.0, 0.0), DVec3::new(42.0, 54.0, 36.0)),
            Self::Head => head(p),
            Self::LeftEar => ear(p, 0.21),
            Self::RightEar => ear(mirrored, 0.50),
            Self::LeftArm => arm(p),
            Self::RightArm => arm(mirrored),
            Self::LeftLeg => leg(p),
            Self::RightLeg => leg(mirrored),
            Self::Tail => (p - DVec3::new(0.0, 64.0, 38.0)).length() - 17.0,
        }
    }

    /// How far `p` lies behind the plane or line at which the limb's front and back are sewn together, mm.
    pub(crate) fn behind_side_seam(self, p: DVec3) -> f64 {
        let axis = |[from, to]: [DVec3; 2]| {
            let mirrored = DVec3::new(p.x.abs(), p.y, p.z);
            let fraction = ((mirrored - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
            p.z - (from.z + fraction * (to.z - from.z))
        };
        match self {
            Self::Body | Self::Head => p.z,
            Self::LeftEar | Self::RightEar => p.z - EAR_DEPTH_MM,
            Self::LeftArm | Self::RightArm => axis(ARM_MM),
            Self::LeftLeg | Self::RightLeg => axis(LEG_MM),
            Self::Tail => f64::INFINITY,
        }
    }
}

/// z of the ears' middle, mm.
const EAR_DEPTH_MM: f64 = 3.0;

/// Shoulder and wrist, hip and ankle of the left side, mm.
const ARM_MM: [DVec3; 2] = [DVec3::new(34.0, 8.0, -1.0), DVec3::new(80.0, 50.0, -12.0)];
const LEG_MM: [DVec3; 2] = [DVec3::new(21.0, 78.0, 0.0), DVec3::new(39.0, 120.0, -5.0)];

/// About the distance of `p` from the toy's surface, mm, negative inside: the smooth minimum of its limbs' distances.
pub(crate) fn distance(p: DVec3) -> f64 {
    LIMBS
        .iter()
        .map(|limb| limb.distance(p))
        .reduce(smooth_minimum)
        .unwrap_or(f64::INFINITY)
}

/// The gradient of [`distance`] by central differences.
pub(crate) fn gradient(p: DVec3) -> DVec3 {
    let along = |axis: DVec3| {
        let step = axis * GRADIENT_STEP_MM;
        (distance(p + step) - distance(p - step)) / (2.0 * GRADIENT_STEP_MM)
    };
    DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
}

/// The limb that `p` belongs to.
pub(crate) fn limb_at(p: DVec3) -> Limb {
    let nearer = |a: Limb, b: Limb| if b.distance(p) < a.distance(p) { b } else { a };
    LIMBS.into_iter().reduce(nearer).unwrap_or(Limb::Body)
}

fn head(p: DVec3) -> f64 {
    let skull = ellipsoid(p - DVec3::new(0.0, -48.0, -2.0), DVec3::new(42.0, 38.0, 37.0));
    let cheeks = DVec3::new(p.x.abs() - 15.0, p.y + 35.0, p.z + 22.0);
    let cheeks = ellipsoid(cheeks, DVec3::new(17.0, 13.0, 14.0));
    let muzzle = ellipsoid(p - DVec3::new(0.0, -39.0, -33.0), DVec3::new(13.0, 10.0, 10.0));
    smooth_minimum(smooth_minimum(skull, cheeks), muzzle)
}

/// An ear that leans outwards by `lean` radians: a flattened round cone, broader towards its tip.
fn ear(p: DVec3, lean: f64) -> f64 {
    let across = DVec2::new(p.x - 17.0, p.y + 78.0);
    let (sine, cosine) = lean.sin_cos();
    // Up the ear, out of its side, through it.
    let along = across.x * sine - across.y * cosine;
    let aside = across.x * cosine + across.y * sine;
    let flattening = 1.9;
    let through = (p.z - EAR_DEPTH_MM) * flattening;
    let q = DVec3::new(aside, along, through);
    round_cone(q, [DVec3::ZERO, DVec3::new(0.0, 66.0, 0.0)], [12.0, 17.5]) / flattening
}

fn arm(p: DVec3) -> f64 {
    let sleeve = round_cone(p, ARM_MM, [17.0, 14.5]);
    let paw = (p - DVec3::new(82.0, 53.0, -13.0)).length() - 17.5;
    smooth_minimum(sleeve, paw)
}

fn leg(p: DVec3) -> f64 {
    let thigh = round_cone(p, LEG_MM, [21.0, 17.0]);
    let foot = ellipsoid(p - DVec3::new(41.0, 128.0, -19.0), DVec3::new(18.0, 15.0, 29.0));
    smooth_minimum(thigh, foot)
}

/// Polynomial smooth minimum (Quilez 2013): as the minimum beyond [`BLEND_MM`], smooth within.
fn smooth_minimum(a: f64, b: f64) -> f64 {
    let fraction = (BLEND_MM - (a - b).abs()).max(0.0) / BLEND_MM;
    a.min(b) - fraction * fraction * BLEND_MM * 0.25
}

/// About the distance from an ellipsoid with half axes `radii` (Quilez 2008: exact to first order at the surface).
fn ellipsoid(p: DVec3, radii: DVec3) -> f64 {
    let scaled = (p / radii).length();
    let slope = (p / (radii * radii)).length();
    if slope < 1e-12 {
        -radii.min_element()
    } else {
        scaled * (scaled - 1.0) / slope
    }
}

/// About the distance from a rod that goes from one end to the other and changes its radius evenly.
fn round_cone(p: DVec3, [from, to]: [DVec3; 2], [r0, r1]: [f64; 2]) -> f64 {
    let fraction = ((p - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
    p.distance(from.lerp(to, fraction)) - (r0 + fraction * (r1 - r0))
}
