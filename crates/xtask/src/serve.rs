//! The demo page on this machine: `www/serve.mjs`, the server that the tests in the browser use too.

use crate::tools;
use anyhow::{Context, Result, bail};
use std::{
    io::{self, BufRead, BufReader},
    path::Path,
    process::{Command, Stdio},
};

/// Serves the page until the server ends: on `port`, or on the first free port from 8080. With `lan` also for the other devices of
/// the network, over https: the port is that one's then, and by default the first free one from 8443.
///
/// # Errors
/// When Node.js does not start, the port is taken, there is no network, or the server fails: it has said so by then.
pub fn demo(root: &Path, port: Option<u16>, lan: bool, open: bool) -> Result<()> {
    let mut command = Command::new("node");
    command.arg(root.join("www/serve.mjs")).arg("--offline");
    command
        .args(lan.then_some("--lan"))
        .args(port.map(|port| port.to_string()));
    let mut child = command.stdout(Stdio::piped()).spawn().context("starting node")?;
    let mut said = BufReader::new(child.stdout.take().context("its output cannot be read")?);
    let mut address = String::new();
    said.read_line(&mut address).context("reading what the server says")?;
    let address = address.trim();
    if address.is_empty() {
        tools::finish(&mut child, "the server")?;
        bail!("the server ended without a word")
    }
    println!("The demo is at {address} (stop with Ctrl-C)");
    if open {
        tools::open_in_browser(address);
    }
    io::copy(&mut said, &mut io::stdout()).context("printing what the server says")?;
    tools::finish(&mut child, "the server")
}
