//! Light on paper: Lambert and Cook-Torrance under one distant light and ambient light.

use crate::random::{uniform, unit_vector};
use deepsft_geometry::glam::{Vec2, Vec3};
use rand::{Rng, RngExt};
use serde::Serialize;

/// Reflectance of a dielectric seen frontally (refractive index 1.5): varnish, toner and coated paper.
const FRESNEL_FRONTAL: f32 = 0.04;

/// Light and paper of [`crate::SynthConfig`].
#[derive(Clone, Debug, Serialize)]
pub struct LightingConfig {
    /// Largest angle between the distant light and the direction from the scene to the camera, degrees. Default
    /// 75 (the paper: 10).
    pub max_angle_deg: f64,
    /// Fraction of the light that is ambient. Default [0.3, 0.85].
    pub ambient_fraction: [f64; 2],
    /// Light that white paper facing the light source sends to the camera, before gain; 1 saturates the sensor. Default [0.4, 1.1].
    pub white_level: [f64; 2],
    /// Largest warm or cold tint of each light, relative. Default 0.18.
    pub tint: f64,
    /// Probability that a scene has the soft edge of a shadow. Default 0.3.
    pub shadow_probability: f64,
    /// Cook-Torrance roughness of the paper; small is glossy. Default [0.28, 0.8].
    pub roughness: [f64; 2],
    /// Strength of the specular lobe, 1 is a varnished surface. Default [0, 1].
    pub specular: [f64; 2],
    /// Fraction of light on the far side that shines through the paper. Default [0, 0.35].
    pub translucency: [f64; 2],
    /// Reflectance of white paper. Default [0.8, 1].
    pub paper_white: [f64; 2],
    /// How much more red and less blue paper reflects than green. Default [-0.03, 0.05].
    pub paper_warmth: [f64; 2],
}

impl Default for LightingConfig {
    fn default() -> Self {
        Self {
            max_angle_deg: 75.0,
            ambient_fraction: [0.3, 0.85],
            white_level: [0.4, 1.1],
            tint: 0.18,
            shadow_probability: 0.3,
            roughness: [0.28, 0.8],
            specular: [0.0, 1.0],
            translucency: [0.0, 0.35],
            paper_white: [0.8, 1.0],
            paper_warmth: [-0.03, 0.05],
        }
    }
}

/// The light of a scene. Directions are in the camera frame.
#[derive(Clone, Debug)]
pub(crate) struct Lighting {
    /// Unit vector towards the distant light.
    pub(crate) towards_light: Vec3,
    /// Light that a white surface facing the light sends to the camera, by colour.
    direct: Vec3,
    /// Light that reaches every surface.
    ambient: Vec3,
    /// Unit vector towards the brighter side of the ambient light and how much brighter it is.
    sky: Vec3,
    sky_fraction: f32,
    shadow: Shadow,
}

/// The soft edge of the shadow of something outside the view: a half-space whose plane need not hold the light.
#[derive(Clone, Debug)]
struct Shadow {
    direction: Vec2,
    /// Where on the ray's (x, y) / z plane the edge lies and half its width.
    edge: f32,
    softness: f32,
    /// Fraction of the direct light that is taken away.
    strength: f32,
}

/// What the sheet is made of.
#[derive(Clone, Debug)]
pub(crate) struct Paper {
    /// Cook-Torrance roughness (GGX alpha = roughness^2).
    pub(crate) roughness: f32,
    /// Fraction of the full specular lobe of a smooth dielectric.
    pub(crate) specular: f32,
    /// Fraction of the light that falls on the far side and shines through.
    pub(crate) translucency: f32,
    /// Reflectance of white paper, by colour: multiplies the texture.
    pub(crate) white: Vec3,
    /// Reflectance of the blank back.
    pub(crate) back: Vec3,
}

impl Lighting {
    /// Draws a scene's light. Exposed so that white paper facing the light is near 0.9 of the sensor's range.
    pub(crate) fn sample<R: Rng + ?Sized>(config: &LightingConfig, rng: &mut R) -> Self {
        let angle = uniform(rng, [0.0, config.max_angle_deg]).to_radians();
        let around = unit_vector(rng) * angle.sin();
        let ambient = uniform(rng, config.ambient_fraction);
        let level = uniform(rng, config.white_level);
        // Warm to cold: red and blue pull in opposite directions.
        let mut tint = || {
            let warmth = uniform(rng, [-config.tint, config.tint]);
            Vec3::new(1.0 + warmth, 1.0, 1.0 - warmth)
        };
        let (direct_tint, ambient_tint) = (tint(), tint());
        let in_shadow = rng.random_bool(config.shadow_probability);
        let shadow = Shadow {
            direction: unit_vector(rng),
            edge: uniform(rng, [-0.4, 0.4]),
            softness: uniform(rng, [0.01, 0.25]),
            strength: if in_shadow { uniform(rng, [0.2, 0.9]) } else { 0.0 },
        };
        Self {
            towards_light: around.extend(-angle.cos()),
            direct: direct_tint * level * (1.0 - ambient),
            ambient: ambient_tint * level * ambient,
            sky: Vec3::new(uniform(rng, [-0.7, 0.7]), -1.0, uniform(rng, [-1.0, 0.3])).normalize(),
            sky_fraction: uniform(rng, [0.0, 0.5]),
            shadow,
        }
    }

    /// Even light from the camera: white paper facing it is exactly 1.
    pub(crate) fn frontal() -> Self {
        Self {
            towards_light: Vec3::NEG_Z,
            direct: Vec3::splat(0.6),
            ambient: Vec3::splat(0.4),
            sky: Vec3::NEG_Y,
            sky_fraction: 0.0,
            shadow: Shadow {
                direction: Vec2::X,
                edge: 0.0,
                softness: 1.0,
                strength: 0.0,
            },
        }
    }

    /// Fraction of the direct light that arrives at a point seen along the ray (x, y, 1).
    fn unshadowed(&self, ray: Vec2) -> f32 {
        if self.shadow.strength == 0.0 {
            return 1.0;
        }
        let t =
            ((ray.dot(self.shadow.direction) - self.shadow.edge) / self.shadow.softness * 0.5 + 0.5).clamp(0.0, 1.0);
        1.0 - self.shadow.strength * t * t * (3.0 - 2.0 * t)
    }

    /// Ambient light on a surface with unit normal `normal`.
    fn ambient_on(&self, normal: Vec3) -> Vec3 {
        self.ambient * (1.0 + self.sky_fraction * normal.dot(self.sky))
    }

    /// Light that a matt surface of reflectance `albedo` sends to the camera.
    pub(crate) fn matt(&self, albedo: Vec3, normal: Vec3, ray: Vec2) -> Vec3 {
        let facing = normal.dot(self.towards_light).max(0.0) * self.unshadowed(ray);
        albedo * (self.direct * facing + self.ambient_on(normal))
    }

    /// Light that paper of reflectance `albedo` with unit normal `normal` (on the seen side) sends to the camera
    /// along the ray (x, y, 1): Lambert, light through the paper, and a Cook-Torrance lobe (GGX distribution,
    /// Schlick's Fresnel term, Kelemen's visibility term).
    pub(crate) fn paper(&self, paper: &Paper, albedo: Vec3, normal: Vec3, ray: Vec2) -> Vec3 {
        let cosine = normal.dot(self.towards_light);
        let direct = self.direct * self.unshadowed(ray);
        let diffuse = albedo * (direct * cosine.max(0.0) + self.ambient_on(normal));
        if cosine <= 0.0 {
            return diffuse + albedo * direct * (-cosine * paper.translucency);
        }
        let towards_camera = -ray.extend(1.0).normalize();
        let half = (towards_camera + self.towards_light).normalize_or(normal);
        let (n_h, l_h) = (normal.dot(half).max(0.0), self.towards_light.dot(half).max(0.1));
        let alpha2 = paper.roughness.powi(4);
        let bell = n_h * n_h * (alpha2 - 1.0) + 1.0;
        let distribution = alpha2 / (bell * bell).max(1e-9); // pi cancels: white Lambert is 1
        let fresnel = FRESNEL_FRONTAL + (1.0 - FRESNEL_FRONTAL) * (1.0 - l_h).powi(5);
        diffuse + direct * (paper.specular * cosine * distribution * fresnel / (4.0 * l_h * l_h))
    }
}

impl Paper {
    /// Draws a sheet's material.
    pub(crate) fn sample<R: Rng + ?Sized>(config: &LightingConfig, rng: &mut R) -> Self {
        let tone = |rng: &mut R, level: [f64; 2]| {
            let warmth = uniform(rng, config.paper_warmth);
            Vec3::new(1.0 + warmth, 1.0, 1.0 - warmth) * uniform(rng, level)
        };
        Self {
            roughness: uniform(rng, config.roughness),
            specular: uniform(rng, config.specular),
            translucency: uniform(rng, config.translucency),
            white: tone(rng, config.paper_white),
            back: tone(rng, [0.55, 0.95]),
        }
    }

    /// Ideal matt paper: the texture as it is, a light grey back.
    pub(crate) fn matt() -> Self {
        Self {
            roughness: 1.0,
            specular: 0.0,
            translucency: 0.0,
            white: Vec3::ONE,
            back: Vec3::splat(0.75),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matt_paper_under_frontal_light_shows_its_own_colour_and_lambert_when_tilted() {
        let (light, paper) = (Lighting::frontal(), Paper::matt());
        let albedo = Vec3::new(0.2, 0.5, 0.9);
        assert!((light.paper(&paper, albedo, Vec3::NEG_Z, Vec2::ZERO) - albedo).length() < 1e-6);
        // 60 degrees: 0.6 * 1/2 + 0.4
        let normal = Vec3::new(3.0_f32.sqrt() / 2.0, 0.0, -0.5);
        assert!((light.paper(&paper, albedo, normal, Vec2::ZERO) - albedo * 0.7).length() < 1e-6);
    }

    #[test]
    fn the_highlight_is_where_the_mirror_would_be() {
        let mut light = Lighting::frontal();
        light.towards_light = Vec3::new(0.6, 0.0, -0.8);
        let paper = Paper {
            roughness: 0.3,
            specular: 1.0,
            ..Paper::matt()
        };
        let gloss = |normal: Vec3| {
            let normal = normal.normalize();
            (light.paper(&paper, Vec3::ONE, normal, Vec2::ZERO) - light.matt(Vec3::ONE, normal, Vec2::ZERO)).x
        };
        let mirror = gloss(Vec3::new(0.6, 0.0, -1.8));
        assert!(mirror > 5.0 * gloss(Vec3::NEG_Z));
        assert!(mirror > 5.0 * gloss(light.towards_light));
        // D / pi = 1 / alpha^2 = 1 / 0.0081, F = 0.04 + 0.96 (1 - c)^5, cosine = l.h = c = sqrt(0.9)
        let c = 0.9_f32.sqrt();
        let expected = 0.6 * (0.04 + 0.96 * (1.0 - c).powi(5)) / 0.0081 / (4.0 * c);
        assert!((mirror / expected - 1.0).abs() < 1e-3, "{mirror} against {expected}");
    }
}
