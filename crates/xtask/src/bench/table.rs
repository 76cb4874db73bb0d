//! The tables of the benchmark.

use serde_json::Value;

/// The browser's tables: title, place of the figure, digits. What was not measured has no row.
const TABLES: &str = "\
inference in the browser, 1 thread, medians of | browser/runs | 0
  canonical warp of 1280 x 720, ms | browser/canonical_warp/median_ms | 2
  network, with packing and reading the maps | browser/network/median_ms | 2
  confidence | browser/confidence/median_ms | 2
camera frame to maps | browser/frame/median_ms | 2
loading engine and model from this machine | browser/load_ms | 0
the same network stage, onnxruntime-web | browser/rival/network/median_ms | 2
  ratio, DeepSfT : onnxruntime-web | browser/rival/ratio | 2
loading onnxruntime-web and the network | browser/rival/load_ms | 0
by WebGPU, medians of | browser/webgpu/runs | 0
  network, with packing and reading the maps, ms | browser/webgpu/network/median_ms | 1
  the same, onnxruntime-web | browser/webgpu/rival/network/median_ms | 1
  ratio, DeepSfT : onnxruntime-web | browser/webgpu/rival/ratio | 3
mesh fitted to one frame, ms | browser/mesh/fit/median_ms | 2
  ARAP completion of one frame | browser/mesh/completion/median_ms | 2
  start of a track | browser/mesh/track_start/median_ms | 2
  one frame followed | browser/mesh/track/median_ms | 2
the demo page without a GPU, frames per second | demo/found_per_second | 1
  network answers per second | demo/answers_per_second | 1
  click to first mesh, ms, first visit | demo/first_mesh_ms/cold | 0
  from a warm cache | demo/first_mesh_ms/warm | 0
  processor time per frame, ms | demo/processor_ms_per_frame/all | 1";

/// Prints the tables that these figures have.
pub fn print(figures: &Value) {
    lines(figures).iter().for_each(|line| println!("{line}"));
}

fn lines(figures: &Value) -> Vec<String> {
    let number = |pointer: &str| figures.pointer(pointer).and_then(Value::as_f64);
    let row = |line: &str| {
        let [title, place, digits] = line.split(" | ").collect::<Vec<_>>().try_into().ok()?;
        let (figure, digits) = (number(&format!("/{place}"))?, digits.parse().ok()?);
        Some(format!("{title:<50}{figure:>10.digits$}"))
    };
    let mut lines: Vec<String> = TABLES.lines().filter_map(row).collect();
    let downloads = figures["downloads"].as_array().map(Vec::as_slice).unwrap_or_default();
    lines.push(format!("\n{:<46}{:>14}{:>14}", "download, MB", "stored", "gzipped"));
    for group in downloads.chunk_by(|a, b| a["of"] == b["of"]) {
        let mut row = |title: &str, files: &[Value]| {
            let sum = |size: &str| files.iter().filter_map(|file| file[size].as_f64()).sum::<f64>() / 1e6;
            lines.push(format!("{title:<46}{:>14.3}{:>14.3}", sum("bytes"), sum("gzip_bytes")));
        };
        for file in group {
            row(
                &format!("  {}", file["file"].as_str().unwrap_or_default()),
                std::slice::from_ref(file),
            );
        }
        row(group[0]["of"].as_str().unwrap_or_default(), group);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_was_measured_has_a_row_and_nothing_else_has() {
        let download =
            |of: &str, file: &str| json!({"of": of, "file": file, "bytes": 2_000_000, "gzip_bytes": 500_000});
        let figures = json!({
            "browser": {"mesh": {"fit": {"median_ms": 3.0}}}, "demo": {"found_per_second": 29.96},
            "downloads": [download("model", "a"), download("model", "b")],
        });
        let lines = lines(&figures).join("\n");
        for row in [
            "the demo page without a GPU, frames per second          30.0",
            "mesh fitted to one frame, ms                            3.00",
            "  a                                                    2.000         0.500",
            "model                                                  4.000         1.000",
        ] {
            assert!(lines.contains(row), "{row:?} is not in\n{lines}");
        }
        assert!(!lines.contains("WebGPU") && !lines.contains("a track"), "{lines}");
    }
}
