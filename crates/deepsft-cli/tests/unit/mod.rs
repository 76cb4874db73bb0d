//! Pictures, videos, networks by name and options of synthetic images.

mod canvas;
mod color_map;
mod curve_plot;
mod ffmpeg;
mod network_choice;
mod panels;
mod sheet;
mod synthesis;
mod turntable;
mod wireframe;
