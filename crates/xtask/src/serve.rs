//! The demo page on this machine: `www/serve.mjs`, the server that the tests in the browser use too.

use crate::tools;
use anyhow::{Context, Result, bail};
use std::{
    io::{BufRead, BufReader},
    path::Path,
    process::{Child, Command, Stdio},
};

/// A running server.
pub struct Server {
    child: Child,
    /// The page's address.
    pub address: String,
}

impl Server {
    /// Starts serving on `port`, or on the first free port from 8080.
    ///
    /// # Errors
    /// When Node.js does not start, or the port is taken: the server has said so by then.
    pub fn start(root: &Path, port: Option<u16>) -> Result<Self> {
        let mut command = Command::new("node");
        command.arg(root.join("www/serve.mjs")).arg("--offline");
        command.args(port.map(|port| port.to_string()));
        let mut child = command.stdout(Stdio::piped()).spawn().context("starting node")?;
        let mut address = String::new();
        if let Some(stdout) = child.stdout.take() {
            BufReader::new(stdout)
                .read_line(&mut address)
                .context("reading what the server says")?;
        }
        if address.is_empty() {
            tools::finish(&mut child, "the server")?;
            bail!("the server ended without a word")
        }
        let address = address.trim().to_owned();
        Ok(Self { child, address })
    }

    /// Waits until the server ends.
    ///
    /// # Errors
    /// When it fails.
    pub fn wait(mut self) -> Result<()> {
        tools::finish(&mut self.child, "the server")
    }
}
