//! The demo page on this machine: `www/serve.mjs`, the server that the tests in the browser use too.

use crate::tools;
use anyhow::{Context, Result, bail};
use std::{
    io::{self, BufRead, BufReader},
    path::Path,
    process::{Child, ChildStdout, Command, Stdio},
};

/// A running server.
pub struct Server {
    child: Child,
    said: BufReader<ChildStdout>,
    /// The page's address.
    pub address: String,
}

impl Server {
    /// Starts serving on `port`, or on the first free port from 8080. With `lan` also for the other devices of the network, over
    /// https: the port is that one's then, and by default the first free one from 8443.
    ///
    /// # Errors
    /// When Node.js does not start, the port is taken, or there is no network: the server has said so by then.
    pub fn start(root: &Path, port: Option<u16>, lan: bool) -> Result<Self> {
        let mut command = Command::new("node");
        command.arg(root.join("www/serve.mjs")).arg("--offline");
        command
            .args(lan.then_some("--lan"))
            .args(port.map(|port| port.to_string()));
        let mut child = command.stdout(Stdio::piped()).spawn().context("starting node")?;
        let stdout = child.stdout.take().context("its output cannot be read")?;
        let mut said = BufReader::new(stdout);
        let mut address = String::new();
        said.read_line(&mut address).context("reading what the server says")?;
        if address.is_empty() {
            tools::finish(&mut child, "the server")?;
            bail!("the server ended without a word")
        }
        let address = address.trim().to_owned();
        Ok(Self { child, said, address })
    }

    /// Prints what the server says, until it ends.
    ///
    /// # Errors
    /// When it fails.
    pub fn wait(mut self) -> Result<()> {
        io::copy(&mut self.said, &mut io::stdout()).context("printing what the server says")?;
        tools::finish(&mut self.child, "the server")
    }
}
