//! A process to be measured: a line on its standard input asks for one piece of work, a line on its standard output answers.

use anyhow::{Context, Result, bail, ensure};
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::thread;
use std::time::Duration;

/// Between two turns: idle threads of the process before may still spin for a while.
const REST: Duration = Duration::from_millis(50);

/// Another program that does the same work when asked.
#[derive(Clone, Copy)]
pub struct Rival<'a> {
    pub name: &'a str,
    /// Program and arguments.
    pub command: &'a [String],
}

/// A process that answers lines with lines. It ends when this is dropped and its input with it.
pub struct Process {
    child: Child,
    questions: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
}

impl Process {
    /// Starts it and tells it the number of threads.
    pub fn start(command: &mut Command, threads: usize) -> Result<Self> {
        let threads = threads.to_string();
        command
            .env("RAYON_NUM_THREADS", &threads)
            .env("DEEPSFT_BENCH_THREADS", &threads);
        let program = command.get_program().to_string_lossy().into_owned();
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("could not start {program}"))?;
        let (Some(questions), Some(answers)) = (child.stdin.take(), child.stdout.take()) else {
            bail!("{program} cannot be talked to");
        };
        Ok(Self {
            child,
            questions: Some(questions),
            answers: BufReader::new(answers),
        })
    }

    /// Its answer to a line.
    pub fn ask(&mut self, question: &str) -> Result<String> {
        thread::sleep(REST);
        self.tell(question)?;
        self.answer()
    }

    /// Sends a line, without waiting for its answer.
    pub fn tell(&mut self, question: &str) -> Result<()> {
        let questions = self.questions.as_mut().context("the process was told to end")?;
        Ok(writeln!(questions, "{question}")?)
    }

    /// The answer to the line that was sent first.
    pub fn answer(&mut self) -> Result<String> {
        let mut answer = String::new();
        self.answers.read_line(&mut answer)?;
        ensure!(!answer.is_empty(), "a process that was to be measured has ended");
        Ok(answer.trim().to_owned())
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.questions = None;
        // It ends by itself; how does not matter any more.
        let _ = self.child.wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn a_process_answers_line_by_line_knows_its_threads_and_its_end_is_an_error() {
        let script = "read x; echo \"$x on $DEEPSFT_BENCH_THREADS\"; read x; echo $RAYON_NUM_THREADS; read x";
        let mut process = Process::start(Command::new("sh").args(["-c", script]), 3).unwrap();
        assert_eq!(process.ask("one").unwrap(), "one on 3");
        assert_eq!(process.ask("two").unwrap(), "3");
        assert!(process.ask("three").unwrap_err().to_string().contains("has ended"));
    }
}
