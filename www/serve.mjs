// The development server, on this machine only: this folder at "/", models/ at "/models/", three.js, for the examples, at "/three/".
// `cargo xtask demo` and the tests in the browser start it. By hand:
//
//     node serve.mjs [PORT] [--offline]
//
// With --offline, as `cargo xtask demo` has it, there is the site's service worker too: browsers then keep the page, and load it again when
// it has changed.

import { createServer } from "node:http";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import sirv from "sirv";

import { docsPageNamed, offlineFiles } from "./site.mjs";

export const WWW = fileURLToPath(new URL(".", import.meta.url));
export const ROOT = fileURLToPath(new URL("..", import.meta.url));

const FOLDERS = { "/models/": join(ROOT, "models"), "/three/": join(WWW, "node_modules", "three", "build"), "/": WWW };
const OFFLINE = /^\/(service-worker|demo\/offline\/version)\.js$/;
const DOCS = /^\/docs\/[\w-]+\.html$/;
const LOOPBACK = "127.0.0.1";

/** The first port that is tried when none is asked for, and how many are. */
const FIRST_PORT = 8080;
const PORTS_TRIED = 50;

/**
 * Serves some folders until closed.
 *
 * @param {object} [options]
 * @param {number} [options.port] 0, the default, takes any free one
 * @param {string} [options.host] an address of this machine; by default only this machine can ask
 * @param {Record<string, string>} [options.folders] by the beginning of their addresses, the longest first
 * @param {Record<string, string>} [options.headers] of every answer
 * @param {boolean} [options.offline] whether browsers may keep the page, for when the server is gone
 * @returns {Promise<{ origin: string, close: () => Promise<void> }>}
 */
export async function serve({ port = 0, host = LOOPBACK, folders = FOLDERS, headers = {}, offline = false } = {}) {
  const places = Object.entries(folders).map(([prefix, folder]) => {
    // With tags, so that browsers ask each time and yet keep what has not changed, compiled code with it.
    return { prefix, files: sirv(folder, { dev: true, etag: true }) };
  });
  const server = createServer(async (request, response) => {
    for (const [name, value] of Object.entries(headers)) response.setHeader(name, value);
    if (offline && OFFLINE.test(request.url)) {
      // Each time, for what is being worked on changes.
      const text = (await offlineFiles())[request.url.slice(1)];
      return response.writeHead(200, { "content-type": "text/javascript", "cache-control": "no-cache" }).end(text);
    }
    if (folders === FOLDERS && DOCS.test(request.url)) {
      const text = await docsPageNamed(request.url.slice(1));
      return response.writeHead(text === undefined ? 404 : 200, { "content-type": "text/html" }).end(text);
    }
    const place = places.find(({ prefix }) => request.url.startsWith(prefix));
    if (!place || /\/\./.test(decoded(request.url))) return response.writeHead(404).end();
    request.url = `/${request.url.slice(place.prefix.length)}`;
    place.files(request, response);
  });
  // Else a connection that has been idle for five seconds is closed, now and then just as a request comes by it.
  server.keepAliveTimeout = 0;
  await new Promise((resolve, reject) => server.once("error", reject).listen(port, host, resolve));
  return {
    // Browsers take localhost for secure: they offer it a camera and WebGPU.
    origin: `http://${host === LOOPBACK ? "localhost" : host}:${server.address().port}`,
    close: () =>
      new Promise((resolve) => {
        server.closeAllConnections();
        server.close(resolve);
      }),
  };
}

/** An address without its escapes, to look for hidden files in. */
function decoded(url) {
  try {
    return decodeURIComponent(url.split("?")[0]);
  } catch {
    return "/.";
  }
}

/** The site on the first port that is free. */
async function serveSomewhere(options) {
  for (let port = FIRST_PORT; port < FIRST_PORT + PORTS_TRIED; port++) {
    try {
      return await serve({ port, ...options });
    } catch (error) {
      if (error.code !== "EADDRINUSE" && error.code !== "EACCES") throw error;
    }
  }
  throw new Error(`no port from ${FIRST_PORT} to ${FIRST_PORT + PORTS_TRIED - 1} is free; choose one`);
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const offline = process.argv.includes("--offline");
  const [port] = process.argv.slice(2).filter((word) => word !== "--offline");
  try {
    const { origin } = await (port === undefined ? serveSomewhere({ offline }) : serve({ port: Number(port), offline }));
    console.log(`${origin}/`);
  } catch (error) {
    console.error(`The page cannot be served${port === undefined ? "" : ` on port ${port}`}: ${error.message}`);
    process.exitCode = 1;
  }
}
