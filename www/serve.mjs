// The development server, on this machine only: this folder at "/", models/ at "/models/", three.js, A-Frame and uqr, which draws codes,
// at "/three/", "/aframe/" and "/uqr/".
// `cargo xtask demo` and the tests in the browser start it. By hand:
//
//     node serve.mjs [PORT] [--offline] [--lan]
//
// With --offline, as `cargo xtask demo` has it, there is the site's service worker too: browsers then keep the page, and load it again when
// it has changed. With --lan there is a second server, for the other devices of the network, over https; the port is then that one's.

import { rmSync } from "node:fs";
import { mkdtemp } from "node:fs/promises";
import { createServer } from "node:http";
import { createServer as createSecureServer } from "node:https";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import sirv from "sirv";

import { docsPageNamed, offlineFiles } from "./site.mjs";

export const WWW = fileURLToPath(new URL(".", import.meta.url));
export const ROOT = fileURLToPath(new URL("..", import.meta.url));

export const FOLDERS = { "/models/": join(ROOT, "models"), "/three/": join(WWW, "node_modules", "three", "build"), "/uqr/": join(WWW, "node_modules", "uqr", "dist"), "/aframe/": join(WWW, "node_modules", "aframe", "dist"), "/": WWW };
const OFFLINE = /^\/(service-worker|demo\/offline\/version)\.js$/;
const DOCS = /^\/docs\/([\w-]+\.html|search\.json)$/;
const REFERENCE = "/docs/api/";
const LOOPBACK = "127.0.0.1";

/** The first port that is tried when none is asked for, on this machine and for the network, and how many are. */
const FIRST_PORT = 8080;
const FIRST_LAN_PORT = 8443;
const PORTS_TRIED = 50;
/** All addresses of this machine; the second where there is no IPv6. */
const EVERYWHERE = ["::", "0.0.0.0"];

/**
 * Serves some folders until closed.
 *
 * @param {object} [options]
 * @param {number} [options.port] 0, the default, takes any free one
 * @param {string} [options.host] an address of this machine; by default only this machine can ask
 * @param {Record<string, string>} [options.folders] by the beginning of their addresses, the longest first
 * @param {Record<string, string>} [options.headers] of every answer
 * @param {boolean} [options.offline] whether browsers may keep the page, for when the server is gone
 * @param {{ key: string, cert: string }} [options.certificate] PEM; with it over https
 * @returns {Promise<{ origin: string, port: number, close: () => Promise<void> }>}
 */
export async function serve({ port = 0, host = LOOPBACK, folders = FOLDERS, headers = {}, offline = false, certificate } = {}) {
  const places = Object.entries(folders).map(([prefix, folder]) => {
    // With tags, so that browsers ask each time and yet keep what has not changed, compiled code with it.
    return { prefix, files: sirv(folder, { dev: true, etag: true }) };
  });
  const create = certificate ? createSecureServer : createServer;
  const server = create({ ...certificate }, async (request, response) => {
    for (const [name, value] of Object.entries(headers)) response.setHeader(name, value);
    if (offline && OFFLINE.test(request.url)) {
      // Each time, for what is being worked on changes.
      const text = (await offlineFiles())[request.url.slice(1)];
      return response.writeHead(200, { "content-type": "text/javascript", "cache-control": "no-cache" }).end(text);
    }
    if (folders === FOLDERS && DOCS.test(request.url)) {
      const text = await docsPageNamed(request.url.slice(1));
      return response.writeHead(text === undefined ? 404 : 200, { "content-type": request.url.endsWith("json") ? "application/json" : "text/html" }).end(text);
    }
    if (folders === FOLDERS && request.url.startsWith(REFERENCE) && !places.some(({ prefix }) => prefix === REFERENCE))
      places.unshift({ prefix: REFERENCE, files: sirv(await reference(), { dev: true }) });
    const place = places.find(({ prefix }) => request.url.startsWith(prefix));
    if (!place || /\/\./.test(decoded(request.url))) return response.writeHead(404).end();
    request.url = `/${request.url.slice(place.prefix.length)}`;
    place.files(request, response);
  });
  // Else a connection that has been idle for five seconds is closed, now and then just as a request comes by it.
  server.keepAliveTimeout = 0;
  await new Promise((resolve, reject) => server.once("error", reject).listen(port, host, resolve));
  const { port: taken } = server.address();
  return {
    // Browsers take localhost for secure: they offer it a camera and WebGPU.
    origin: `${certificate ? "https" : "http"}://${[LOOPBACK, ...EVERYWHERE].includes(host) ? "localhost" : host}:${taken}`,
    port: taken,
    close: () =>
      new Promise((resolve) => {
        server.closeAllConnections();
        server.close(resolve);
      }),
  };
}

/** A folder with the reference of the package, made when it is first asked for. @type {Promise<string> | undefined} */
let referenceFolder;

function reference() {
  return (referenceFolder ??= (async () => {
    const { writeReference } = await import("./reference.mjs");
    const folder = await mkdtemp(join(tmpdir(), "deepsft-reference-"));
    process.once("exit", () => rmSync(folder, { recursive: true, force: true }));
    await writeReference(folder);
    return folder;
  })());
}

/** An address without its escapes, to look for hidden files in. */
function decoded(url) {
  try {
    return decodeURIComponent(url.split("?")[0]);
  } catch {
    return "/.";
  }
}

/** The site on a port, or else on the first from `first` on that is free. */
async function serveSomewhere(port, first, options) {
  if (port !== undefined) return serve({ port: Number(port), ...options });
  for (let port = first; port < first + PORTS_TRIED; port++) {
    try {
      return await serve({ port, ...options });
    } catch (error) {
      if (error.code !== "EADDRINUSE" && error.code !== "EACCES") throw error;
    }
  }
  throw new Error(`no port from ${first} to ${first + PORTS_TRIED - 1} is free; choose one`);
}

/**
 * The site for the other devices of the network. Without the service worker: browsers refuse it where nobody vouches for the certificate.
 *
 * @param {string | undefined} port
 * @returns {Promise<string>} what a person has to know of it
 */
async function serveLan(port) {
  const { lanAddresses, lanWords, makeCertificate } = await import("./lan.mjs");
  const addresses = lanAddresses();
  if (addresses.length === 0)
    throw new Error("this machine is in no network, so no phone can reach it; connect it to the phone's network and try again");
  const certificate = await makeCertificate(addresses);
  const [everywhere, withoutIpv6] = EVERYWHERE;
  const server = await serveSomewhere(port, FIRST_LAN_PORT, { host: everywhere, certificate }).catch((error) => {
    if (error.code !== "EAFNOSUPPORT" && error.code !== "EADDRNOTAVAIL") throw error;
    return serveSomewhere(port, FIRST_LAN_PORT, { host: withoutIpv6, certificate });
  });
  return lanWords(addresses, server.port);
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const words = process.argv.slice(2);
  const [offline, lan] = ["--offline", "--lan"].map((option) => words.includes(option));
  const port = words.find((word) => !word.startsWith("--"));
  try {
    // First what may fail: this machine's own server has other ports to go to.
    const lanText = lan ? await serveLan(port) : undefined;
    // Pages that were copied from the list of examples run on other servers.
    const headers = { "access-control-allow-origin": "*" };
    const { origin } = await serveSomewhere(lan ? undefined : port, FIRST_PORT, { offline, headers });
    console.log(`${origin}/`);
    if (lanText !== undefined) console.log(`\n${lanText}`);
  } catch (error) {
    console.error(`The page cannot be served${port === undefined ? "" : ` on port ${port}`}: ${error.message}`);
    process.exit(1);
  }
}
