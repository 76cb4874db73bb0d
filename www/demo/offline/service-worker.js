// Keeps one whole version of the site in this browser, and answers from it alone: the page then works offline, and never with files of two
// versions. site.mjs writes `SITE` before this text, so that each version is another service worker.

/** @type {{ version: string, files: Record<string, string> }} SHA-256 of each file, hexadecimal */
const { version, files } = /** @type {any} */ (self).SITE;
const worker = /** @type {any} */ (self);
const SCOPE = worker.registration.scope;
const CACHES = `deepsft-site ${SCOPE} `;
const CACHE = CACHES + version;
const PAGE = "index.html";

worker.addEventListener("install", (/** @type {any} */ event) => event.waitUntil(keepAll()));
worker.addEventListener("activate", (/** @type {any} */ event) => event.waitUntil(dropOthers()));
worker.addEventListener("message", (/** @type {any} */ event) => event.data === "take-over" && event.waitUntil(takeOver()));
worker.addEventListener("fetch", (/** @type {any} */ event) => {
  const { url, method } = event.request;
  if (method !== "GET" || !url.startsWith(SCOPE)) return;
  const path = decodeURI(new URL(url).pathname.slice(new URL(SCOPE).pathname.length));
  const name = path === "" ? PAGE : path;
  if (Object.hasOwn(files, name)) event.respondWith(answer(name, event.request));
});

/** A new version is there when all of it is; what did not change is taken from the one before. */
async function keepAll() {
  const cache = await caches.open(CACHE);
  const keep = async (/** @type {string} */ name) => cache.put(keyOf(name), (await caches.match(keyOf(name))) ?? (await fetched(name)));
  await Promise.all(Object.keys(files).map(keep));
}

async function dropOthers() {
  const others = (await caches.keys()).filter((name) => name.startsWith(CACHES) && name !== CACHE);
  await Promise.all(others.map((name) => caches.delete(name)));
}

/** Takes the place of the version before, unless a second window would then have files of both. */
async function takeOver() {
  const windows = await worker.clients.matchAll({ type: "window", includeUncontrolled: true });
  if (windows.filter((/** @type {{ url: string }} */ { url }) => url.startsWith(SCOPE)).length === 1) await worker.skipWaiting();
}

/**
 * @param {string} name
 * @param {Request} request
 */
async function answer(name, request) {
  const kept = await (await caches.open(CACHE)).match(keyOf(name));
  if (kept) return request.headers.has("range") ? part(kept, request.headers.get("range") ?? "") : kept;
  if (request.mode !== "navigate") return fetched(name);
  // The browser has thrown the files away: the page begins anew.
  await worker.registration.unregister();
  return fetch(request);
}

/**
 * A file from the server, if it is that of this version.
 *
 * @param {string} name
 */
async function fetched(name) {
  const response = await fetch(SCOPE + name, { cache: "no-cache" });
  const bytes = await response.arrayBuffer();
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", bytes));
  if (Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("") !== files[name])
    throw new Error(`${name} is not of version ${version}.`);
  const headers = new Headers(response.headers);
  headers.delete("content-encoding");
  headers.set("content-length", String(bytes.byteLength));
  // A new response, for one that was redirected cannot be a page.
  return new Response(bytes, { headers });
}

/**
 * Of a video the bytes that its player asks for.
 *
 * @param {Response} whole
 * @param {string} range
 */
async function part(whole, range) {
  const bytes = await whole.arrayBuffer();
  const { byteLength: length } = bytes;
  const [, first = "", last = ""] = /^bytes=(\d*)-(\d*)$/.exec(range) ?? [];
  const headers = new Headers(whole.headers);
  // Servers may give all where they do not understand.
  if (first + last === "") return new Response(bytes, { headers });
  const [from, to] = first === "" ? [Math.max(0, length - Number(last)), length - 1] : [Number(first), Math.min(Number(last || length), length - 1)];
  if (from > to) return new Response(null, { status: 416, headers: { "content-range": `bytes */${length}` } });
  headers.set("content-length", String(to - from + 1));
  headers.set("content-range", `bytes ${from}-${to}/${length}`);
  return new Response(bytes.slice(from, to + 1), { status: 206, headers });
}

/** @param {string} name */
function keyOf(name) {
  return `${SCOPE}${name}?sha256=${files[name]}`;
}
