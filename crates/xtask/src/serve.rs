//! A static file server for the demo: `www/` at `/`, `models/` at `/models/`, on this machine only.

use anyhow::{Context, Result, bail};
use std::{
    fs::File,
    io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write},
    net::{Ipv4Addr, TcpListener, TcpStream},
    path::{Path, PathBuf},
    thread,
    time::Duration,
};

/// The first port that is tried when none is asked for, and how many are.
const FIRST_PORT: u16 = 8080;
const PORTS_TRIED: u16 = 50;

/// A request's head is read up to this many bytes, and no longer than this.
const HEAD_LIMIT: u64 = 16 * 1024;
const PATIENCE: Duration = Duration::from_secs(10);

/// A bound, not yet running, server.
pub struct Server {
    listener: TcpListener,
    port: u16,
    site: Site,
}

/// The two folders that are public.
#[derive(Clone)]
struct Site {
    www: PathBuf,
    models: PathBuf,
}

impl Server {
    /// Binds 127.0.0.1 on `port`, or on the first free port from 8080.
    ///
    /// # Errors
    /// When the port is taken, or the workspace's folders are missing.
    pub fn bind(root: &Path, port: Option<u16>) -> Result<Self> {
        let public = |name: &str| {
            let folder = root.join(name);
            folder
                .canonicalize()
                .with_context(|| format!("finding the folder {}", folder.display()))
        };
        let site = Site {
            www: public("www")?,
            models: public("models")?,
        };
        let listener = match port {
            Some(port) => {
                listen(port).with_context(|| format!("port {port} cannot be used; choose another with --port"))?
            }
            None => (FIRST_PORT..FIRST_PORT + PORTS_TRIED)
                .find_map(|port| listen(port).ok())
                .with_context(|| format!("no port from {FIRST_PORT} on is free; choose one with --port"))?,
        };
        let port = listener.local_addr().context("asking for the port")?.port();
        Ok(Self { listener, port, site })
    }

    /// The page's address.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/", self.port)
    }

    /// Serves until the process ends, one thread a connection.
    ///
    /// # Errors
    /// When the listening socket fails.
    pub fn run(self) -> Result<()> {
        for connection in self.listener.incoming() {
            let connection = connection.context("accepting a connection")?;
            let site = self.site.clone();
            // A browser that goes away in mid-answer is no event.
            thread::spawn(move || drop(answer(connection, &site)));
        }
        bail!("the listening socket was closed")
    }
}

fn listen(port: u16) -> io::Result<TcpListener> {
    TcpListener::bind((Ipv4Addr::LOCALHOST, port))
}

/// Reads one request and answers it; the connection is closed after that.
fn answer(connection: TcpStream, site: &Site) -> io::Result<()> {
    connection.set_read_timeout(Some(PATIENCE))?;
    connection.set_write_timeout(Some(PATIENCE))?;
    let mut lines = BufReader::new(connection.try_clone()?.take(HEAD_LIMIT)).lines();
    let request_line = lines.next().transpose()?.unwrap_or_default();
    let mut range = None;
    for line in lines {
        let line = line?;
        if line.is_empty() {
            break;
        }
        if let Some((name, value)) = line.split_once(':')
            && name.eq_ignore_ascii_case("range")
        {
            range = Some(value.trim().to_owned());
        }
    }
    let mut words = request_line.split(' ');
    let (method, target) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
    let mut connection = connection;
    if method != "GET" && method != "HEAD" {
        return refuse(&mut connection, "405 Method Not Allowed");
    }
    let Some(path) = site.file(target) else {
        return refuse(&mut connection, "404 Not Found");
    };
    let Ok(mut file) = File::open(&path) else {
        return refuse(&mut connection, "404 Not Found");
    };
    let length = file.metadata()?.len();
    let (status, first, count) = match range.as_deref().map(|range| byte_range(range, length)) {
        None | Some(Range::Ignored) => ("200 OK", 0, length),
        Some(Range::Bytes { first, count }) => ("206 Partial Content", first, count),
        Some(Range::Outside) => return refuse(&mut connection, "416 Range Not Satisfiable"),
    };
    write!(
        connection,
        "HTTP/1.1 {status}\r\nContent-Type: {}\r\nContent-Length: {count}\r\nAccept-Ranges: bytes\r\n\
         Cache-Control: no-cache\r\nX-Content-Type-Options: nosniff\r\nConnection: close\r\n",
        media_type(&path)
    )?;
    if count != length {
        write!(
            connection,
            "Content-Range: bytes {first}-{}/{length}\r\n",
            first + count - 1
        )?;
    }
    connection.write_all(b"\r\n")?;
    if method == "GET" {
        file.seek(SeekFrom::Start(first))?;
        io::copy(&mut file.take(count), &mut connection)?;
    }
    connection.flush()
}

fn refuse(connection: &mut TcpStream, status: &str) -> io::Result<()> {
    let length = status.len();
    write!(
        connection,
        "HTTP/1.1 {status}\r\nContent-Type: text/plain\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{status}"
    )?;
    connection.flush()
}

impl Site {
    /// The file a request's target names: below one of the public folders, not hidden. `None` for
    /// anything else, also when a link leads outside.
    fn file(&self, target: &str) -> Option<PathBuf> {
        let path = target.split(['?', '#']).next()?;
        let decoded = percent_decoded(path)?;
        let mut names = decoded.strip_prefix('/')?.split('/').peekable();
        let public = match names.peek() {
            Some(&"models") => {
                names.next();
                &self.models
            }
            _ => &self.www,
        };
        let mut file = public.clone();
        for name in names {
            if name.starts_with('.') || name.contains(['\\', ':', '\0']) {
                return None;
            }
            file.push(name);
        }
        if file.is_dir() {
            file.push("index.html");
        }
        let file = file.canonicalize().ok()?;
        (file.starts_with(public) && file.is_file()).then_some(file)
    }
}

fn percent_decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        if byte == b'%' {
            let digits = [rest.next()?, rest.next()?];
            if !digits.iter().all(u8::is_ascii_hexdigit) {
                return None;
            }
            bytes.push(u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?);
        } else {
            bytes.push(byte);
        }
    }
    String::from_utf8(bytes).ok()
}

/// What a `Range` header asks of a file.
#[derive(Debug, PartialEq)]
enum Range {
    Bytes {
        first: u64,
        count: u64,
    },
    Outside,
    /// Several ranges or another unit: the whole file is a correct answer.
    Ignored,
}

/// Video players ask for `bytes=a-b`, `bytes=a-` and `bytes=-n` (the last n).
fn byte_range(header: &str, length: u64) -> Range {
    let parse = || -> Option<(Option<u64>, Option<u64>)> {
        let (first, last) = header.strip_prefix("bytes=")?.split_once('-')?;
        let number = |text: &str| {
            if text.is_empty() {
                Some(None)
            } else {
                text.parse().ok().map(Some)
            }
        };
        Some((number(first)?, number(last)?))
    };
    let (first, end) = match parse() {
        None | Some((None, None)) => return Range::Ignored,
        Some((Some(first), None)) => (first, length),
        Some((Some(first), Some(last))) if first > last => return Range::Ignored,
        Some((Some(first), Some(last))) => (first, last.saturating_add(1).min(length)),
        Some((None, Some(count))) => (length.saturating_sub(count), length),
    };
    if first < end {
        Range::Bytes {
            first,
            count: end - first,
        }
    } else {
        Range::Outside
    }
}

fn media_type(path: &Path) -> &'static str {
    match path
        .extension()
        .and_then(|extension| extension.to_str())
        .unwrap_or_default()
    {
        "html" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" | "map" => "application/json",
        "md" => "text/markdown; charset=utf-8",
        "txt" | "ts" => "text/plain; charset=utf-8",
        "wasm" => "application/wasm",
        "webmanifest" => "application/manifest+json",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        "webp" => "image/webp",
        "ico" => "image/x-icon",
        "mp4" => "video/mp4",
        "webm" => "video/webm",
        "pdf" => "application/pdf",
        "glb" => "model/gltf-binary",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// A running server over a folder with a page, a script, a model, a hidden file and a secret beside
    /// the public folders.
    fn serving() -> (tempfile::TempDir, u16) {
        let root = tempfile::tempdir().unwrap();
        for (file, text) in [
            ("www/index.html", "<p>page"),
            ("www/a b.js", "0123456789"),
            ("www/.hidden", "secret"),
            ("models/m/model.json", "{}"),
            ("secret.txt", "secret"),
        ] {
            let path = root.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink(root.path().join("secret.txt"), root.path().join("www/link.txt")).unwrap();
        let server = Server::bind(root.path(), Some(0)).unwrap();
        let port = server.port;
        thread::spawn(move || server.run());
        (root, port)
    }

    fn request(port: u16, request: &str) -> String {
        let mut connection = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).unwrap();
        connection.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        connection.read_to_string(&mut answer).unwrap();
        answer
    }

    fn get(port: u16, target: &str) -> String {
        request(port, &format!("GET {target} HTTP/1.1\r\nHost: localhost\r\n\r\n"))
    }

    #[test]
    fn pages_scripts_and_models_are_served_with_their_types() {
        let (_root, port) = serving();
        let page = get(port, "/");
        assert!(page.starts_with("HTTP/1.1 200 OK\r\nContent-Type: text/html"), "{page}");
        assert!(page.ends_with("\r\n\r\n<p>page"), "{page}");
        assert!(get(port, "/a%20b.js?v=1").contains("text/javascript"));
        assert!(get(port, "/models/m/model.json").contains("application/json"));
        assert_eq!(media_type(Path::new("x_bg.wasm")), "application/wasm");
    }

    #[test]
    fn nothing_outside_the_public_folders_is_served() {
        let (_root, port) = serving();
        for target in [
            "/../secret.txt",
            "/%2e%2e/secret.txt",
            "/models/../secret.txt",
            "/models/..%2fsecret.txt",
            "/models//../../secret.txt",
            "/..\\secret.txt",
            "//etc/passwd",
            "/.hidden",
            "/link.txt",
            "/%",
            "/%ff",
            "/%+1",
            "secret.txt",
            "/absent",
        ] {
            let answer = get(port, target);
            assert!(answer.starts_with("HTTP/1.1 404"), "{target}: {answer}");
            assert!(!answer.contains("secret"), "{target}: {answer}");
        }
        assert!(request(port, "POST / HTTP/1.1\r\n\r\n").starts_with("HTTP/1.1 405"));
        assert!(request(port, "\r\n\r\n").starts_with("HTTP/1.1 405"));
    }

    #[test]
    fn a_video_player_gets_the_bytes_it_asks_for() {
        let (_root, port) = serving();
        let part = |range: &str| request(port, &format!("GET /a%20b.js HTTP/1.1\r\nrange: {range}\r\n\r\n"));
        let middle = part("bytes=2-4");
        assert!(middle.starts_with("HTTP/1.1 206"), "{middle}");
        assert!(
            middle.contains("Content-Range: bytes 2-4/10") && middle.ends_with("\r\n\r\n234"),
            "{middle}"
        );
        assert!(part("bytes=7-").ends_with("\r\n\r\n789"));
        assert!(part("bytes=-2").ends_with("\r\n\r\n89"));
        assert!(part("bytes=5-99").ends_with("\r\n\r\n56789"));
        assert!(part("bytes=10-").starts_with("HTTP/1.1 416"));
        assert!(part("bytes=0-1,3-4").starts_with("HTTP/1.1 200"));
        assert!(request(port, "HEAD / HTTP/1.1\r\n\r\n").ends_with("\r\n\r\n"));
    }

    #[test]
    fn a_taken_port_is_an_error_that_says_what_to_do() {
        let (root, port) = serving();
        let error = Server::bind(root.path(), Some(port)).err().unwrap();
        assert!(format!("{error:#}").contains("--port"), "{error:#}");
    }
}
