//! Cameras as other programs write them: OpenCV, ROS, Kalibr, COLMAP, ORB-SLAM, RealSense, Open3D, ARKit.

use crate::camera::CameraFile;
use crate::error::FormatError;
use crate::reasons::json_reason;
use deepsft_geometry::Camera;
use deepsft_geometry::glam::DVec2;
use serde_json::{Map, Value};

/// Names of a camera matrix, of its distortion, of the image's sides and of the lens's model, in small letters and digits alone.
const MATRIX: [&str; 8] = [
    "cameramatrix",
    "intrinsicmatrix",
    "intrinsics",
    "intrinsic",
    "cameraintrinsics",
    "k",
    "mtx",
    "m1",
];
const DISTORTION: [&str; 9] = [
    "distortioncoefficients",
    "distortioncoeffs",
    "distcoeffs",
    "distcoeff",
    "distortion",
    "coeffs",
    "dist",
    "d",
    "d1",
];
const SIZE: [&str; 5] = ["resolution", "imagesize", "imageresolution", "imgsize", "size"];
const SIDES: [&[&str]; 2] = [&["imagewidth", "width", "w"], &["imageheight", "height", "h"]];
const MODEL: [&str; 4] = ["distortionmodel", "cameramodel", "distortiontype", "model"];

/// Parts of the names of models that are OpenCV's fisheye, and of those that are none of OpenCV's.
const FISHEYE: [&str; 3] = ["equidistant", "fisheye", "kannala"];
const UNKNOWN: [&str; 7] = ["omni", "eucm", "doublesphere", "mei", "fov", "unified", "inverse"];

/// Elements within one another in XML at most.
const DEEPEST: usize = 16;

/// Reads a camera as another program wrote it: of OpenCV (YAML, XML, JSON), ROS, Kalibr, COLMAP, ORB-SLAM, RealSense, Open3D or ARKit.
///
/// COLMAP has the centre of the first pixel at (0.5, 0.5), as we do; the others have it at (0, 0), so half a pixel is added to cx and cy. A
/// file with the names of a `camera.json` is one, in YAML too. Of several cameras the first is taken.
///
/// # Errors
/// [`FormatError::CameraFile`] says what is missing or not known of the lens; [`FormatError::Geometry`].
pub fn camera_from_foreign(bytes: &[u8]) -> Result<Camera, FormatError> {
    let text = match str::from_utf8(bytes) {
        Ok(text) if !text.contains('\0') => text.trim_start_matches('\u{feff}').trim(),
        _ => return unknown("it is no text: write the camera as JSON, YAML, XML or COLMAP's cameras.txt"),
    };
    if text.is_empty() {
        return unknown("it is empty: copy it again from where it came");
    }
    if let Some(camera) = colmap(text) {
        return camera;
    }
    let tree = tree(text)?;
    if let Ok(own) = serde_json::from_value::<CameraFile>(tree.clone()) {
        return own.camera();
    }
    let numbers_of = |names: &[&str]| find(&tree, names, &numbers);
    let number_of = |names: &[&str]| numbers_of(names).and_then(|numbers| numbers.first().copied());
    let all_of = |names: [&[&str]; 2]| Some([number_of(names[0])?, number_of(names[1])?]);
    let model = |name| find(&tree, &[name], &|value| value.as_str().map(plain));
    let model = MODEL.into_iter().filter_map(model).collect::<Vec<_>>().join(" ");
    let is = |names: &[&str]| names.iter().any(|name| model.contains(name));
    let is_unknown = !is(&FISHEYE) && (is(&UNKNOWN) || model.ends_with("ds"));
    let other_model = || {
        unknown(&format!(
            "its lens model ({model}) is none of OpenCV's: calibrate with pinhole and radtan, or with equidistant"
        ))
    };
    let entries = numbers_of(&MATRIX);
    let matrix = entries.as_ref().and_then(|numbers| match numbers[..] {
        [fx, _, 0.0, _, fy, 0.0, cx, cy, 1.0] | [fx, _, cx, _, fy, cy, _, _, _] | [fx, fy, cx, cy] => {
            Some([fx, fy, cx, cy])
        }
        _ => None,
    });
    let scalars = || {
        let ([fx, fy], [cx, cy]) = (all_of([&["fx"], &["fy"]])?, all_of([&["cx", "ppx"], &["cy", "ppy"]])?);
        Some([fx, fy, cx, cy])
    };
    let Some([fx, fy, cx, cy]) = matrix.or_else(scalars) else {
        return match entries {
            _ if is_unknown => other_model(),
            Some(entries) => unknown(&format!(
                "its camera matrix has {} numbers: 9 are expected, or fx, fy, cx, cy",
                entries.len()
            )),
            None => unknown(
                "it has no camera matrix (camera_matrix, K, intrinsics) and not all of fx, fy, cx, cy: add them, in pixels",
            ),
        };
    };
    let size = find(&tree, &SIZE, &|value| match numbers(value)?[..] {
        [width, height] => Some([width, height]),
        _ => None,
    });
    let Some([width, height]) = all_of(SIDES).or(size) else {
        return unknown("it does not say the image's size: add image_width and image_height, in pixels");
    };
    if width < 1.0 || height < 1.0 {
        return unknown(&format!("its image has {width} x {height} pixels: correct it there"));
    }
    let single = || match is(&FISHEYE) {
        true => ["k1", "k2", "k3", "k4"]
            .map(|name| number_of(&[name]).unwrap_or_default())
            .to_vec(),
        false => ["k1", "k2", "p1", "p2", "k3"]
            .map(|name| number_of(&[name]).unwrap_or_default())
            .to_vec(),
    };
    let lens = numbers_of(&DISTORTION).unwrap_or_else(single);
    let camera = Camera::pinhole(
        (width as usize, height as usize),
        DVec2::new(fx, fy),
        DVec2::new(cx, cy) + 0.5,
    )?;
    if lens.iter().all(|k| *k == 0.0) {
        Ok(camera)
    } else if is(&FISHEYE) {
        fisheye(camera, &lens)
    } else if is_unknown {
        other_model()
    } else {
        Ok(camera.with_opencv_distortion(&lens)?)
    }
}

fn unknown<T>(reason: &str) -> Result<T, FormatError> {
    Err(FormatError::CameraFile(reason.to_owned()))
}

fn fisheye(camera: Camera, coefficients: &[f64]) -> Result<Camera, FormatError> {
    match coefficients.first_chunk() {
        Some(four) if coefficients[4..].iter().all(|k| *k == 0.0) => Ok(camera.with_fisheye(*four)?),
        _ => unknown("its fisheye lens has not the four coefficients of OpenCV's: calibrate with equidistant"),
    }
}

/// The camera of COLMAP's `cameras.txt`. `None` for another file.
fn colmap(text: &str) -> Option<Result<Camera, FormatError>> {
    let mut lines = text
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty() && !line.starts_with('#'));
    let words: Vec<&str> = lines.next()?.split_ascii_whitespace().collect();
    let [id, model, width, height, parameters @ ..] = &words[..] else {
        return None;
    };
    let is_line = id.parse::<u32>().is_ok() && model.chars().all(|c| c.is_ascii_uppercase() || c == '_');
    let size = (width.parse::<usize>().ok()?, height.parse::<usize>().ok()?);
    if !is_line {
        return None;
    }
    let parameters = parameters.iter().map(|word| word.parse().map_err(|_| *word));
    let parameters: Vec<f64> = match parameters.collect() {
        Ok(parameters) => parameters,
        Err(word) => {
            return Some(unknown(&format!(
                "it has {word:?} where a number is expected: correct it there"
            )));
        }
    };
    if lines.next().is_some() {
        return Some(unknown(
            "it has several cameras: leave the line of the one that is meant",
        ));
    }
    let (focal, centre, lens) = match (*model, &parameters[..]) {
        ("PINHOLE" | "OPENCV" | "FULL_OPENCV" | "OPENCV_FISHEYE", &[fx, fy, cx, cy, ref lens @ ..]) => {
            ([fx, fy], [cx, cy], lens.to_vec())
        }
        ("SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL", &[f, cx, cy, ref lens @ ..])
        | ("SIMPLE_RADIAL_FISHEYE" | "RADIAL_FISHEYE", &[f, cx, cy, ref lens @ ..])
            if lens.len() <= 2 =>
        {
            ([f, f], [cx, cy], [lens, &vec![0.0; 4 - lens.len()]].concat())
        }
        (model, parameters) => {
            let count = parameters.len();
            return Some(unknown(&format!(
                "COLMAP's model {model} with {count} numbers is not read: export OPENCV (8 numbers) or OPENCV_FISHEYE (8)"
            )));
        }
    };
    let camera = Camera::pinhole(size, focal.into(), centre.into()).map_err(Into::into);
    Some(camera.and_then(|camera| match model.ends_with("FISHEYE") {
        true => fisheye(camera, &lens),
        false => Ok(camera.with_opencv_distortion(&lens)?),
    }))
}

/// What a file in JSON, XML or YAML says.
fn tree(text: &str) -> Result<Value, FormatError> {
    if text.starts_with('<') {
        let read = roxmltree::Document::parse(text).map_err(|error| damaged("XML", &error.to_string()))?;
        return Ok(element(read.root_element(), 0));
    }
    if text.starts_with('{') {
        return serde_json::from_str(text).map_err(|error| FormatError::CameraFile(json_reason(&error)));
    }
    // OpenCV's directive is none of YAML's, and of a recorded stream the first message is enough.
    let lines = text
        .lines()
        .skip_while(|line| line.starts_with(['%', '-', '#']) || line.is_empty());
    let first = lines.take_while(|line| *line != "---").collect::<Vec<_>>().join("\n");
    let read = serde_saphyr::from_str::<Value>(&first);
    // What follows draws the place.
    read.map_err(|error| damaged("YAML", error.to_string().lines().next().unwrap_or_default()))
}

fn damaged(form: &str, said: &str) -> FormatError {
    let said = said.trim_start_matches("error: ");
    FormatError::CameraFile(format!(
        "its {form} cannot be read ({said}): correct it there, or copy it again"
    ))
}

/// An element of XML: its children by name, or its text.
fn element(node: roxmltree::Node<'_, '_>, depth: usize) -> Value {
    let children = node.children().filter(roxmltree::Node::is_element);
    let children = children.map(|child| (child.tag_name().name().to_owned(), child));
    let named: Map<String, Value> = match depth < DEEPEST {
        true => children
            .map(|(name, child)| (name, element(child, depth + 1)))
            .collect(),
        false => Map::new(),
    };
    match named.is_empty() {
        true => Value::from(node.text().unwrap_or_default()),
        false => Value::Object(named),
    }
}

/// The first value of one of these names that `read` reads, those farther out before those within.
fn find<T>(tree: &Value, names: &[&str], read: &impl Fn(&Value) -> Option<T>) -> Option<T> {
    let (here, within): (_, Vec<&Value>) = match tree {
        Value::Object(fields) => {
            let is_named = |key: &String| names.contains(&&*plain(key.rsplit('.').next().unwrap_or_default()));
            let here = fields
                .iter()
                .filter(|(key, _)| is_named(key))
                .find_map(|(_, value)| read(value));
            (here, fields.values().collect())
        }
        Value::Array(values) => (None, values.iter().collect()),
        _ => return None,
    };
    here.or_else(|| within.into_iter().find_map(|value| find(value, names, read)))
}

/// Small letters and digits alone.
fn plain(name: &str) -> String {
    let kept = name.chars().filter(char::is_ascii_alphanumeric);
    kept.map(|letter| letter.to_ascii_lowercase()).collect()
}

/// The numbers of a list, of a list of lists, of a matrix with its `data`, or in words.
fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Number(number) => Some(vec![number.as_f64()?]),
        Value::Array(values) => Some(values.iter().map(numbers).collect::<Option<Vec<_>>>()?.concat()),
        Value::Object(fields) => numbers(fields.get("data")?),
        Value::String(words) => {
            let words = words
                .split(|c: char| c.is_whitespace() || c == ',')
                .filter(|word| !word.is_empty());
            words.map(|word| word.parse().ok()).collect()
        }
        _ => None,
    }
}
