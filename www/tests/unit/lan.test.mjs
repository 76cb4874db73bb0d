// The page for the other devices of the network: where it is found, its certificate, its code, and what is said when it cannot be had.

import assert from "node:assert/strict";
import { X509Certificate } from "node:crypto";
import { spawn, spawnSync } from "node:child_process";
import { once } from "node:events";
import { request } from "node:https";
import { createServer } from "node:net";
import { networkInterfaces } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import jsqr from "jsqr";

import { lanAddresses, lanWords, makeCertificate } from "../../lan.mjs";
import { WWW } from "../../serve.mjs";

const address = (address, internal = false) => ({ address, internal, family: address.includes(":") ? "IPv6" : "IPv4" });
const INTERFACES = {
  lo: [address("127.0.0.1", true), address("::1", true)],
  docker0: [address("172.17.0.1")],
  "br-5f2": [address("172.18.0.1")],
  eth0: [address("fe80::1"), address("2001:db8::5"), address("192.168.1.23")],
  wlan0: [address("10.0.0.7")],
  usb0: [address("169.254.3.4")],
};

/** Why there is nothing to open, if so. */
const skip = lanAddresses().length > 0 ? false : "this machine is in no network";

let server;
/** What the server has printed. */
let text = "";

before(async () => {
  if (skip) return;
  server = spawn(process.execPath, [join(WWW, "serve.mjs"), "--lan"], { stdio: ["ignore", "pipe", "inherit"] });
  server.stdout.on("data", (chunk) => (text += chunk));
  while (!text.includes("everybody")) await once(server.stdout, "data");
});
after(() => server?.kill());

/** The addresses that a text names, in their order. */
const addressesIn = (words) => words.match(/https:\/\/\S+\//g);

/** What the codes in a text say, as a phone reads them from the screen. */
function codesIn(words) {
  const lines = words.replaceAll(/\x1b\[[\d;]*m/g, "").split("\n");
  const isCode = (line) => /^ {4}[█▀▄ ]{20,}$/.test(line);
  const starts = lines.flatMap((line, i) => (isCode(line) && !isCode(lines[i - 1] ?? "") ? [i] : []));
  return starts.map((start) => {
    const code = lines.slice(start, lines.findIndex((line, i) => i > start && !isCode(line))).map((line) => line.slice(4));
    const [modules, side] = [code[0].length, 6];
    const pixels = new Uint8ClampedArray(4 * (modules * side) ** 2).fill(255);
    for (let y = 0; y < modules * side; y++) {
      for (let x = 0; x < modules * side; x++) {
        const [column, row] = [Math.floor(x / side), Math.floor(y / side)];
        const half = row % 2 === 0 ? "█▀" : "█▄";
        const white = half.includes(code[row >> 1]?.[column] ?? "█") ? 255 : 0;
        pixels.fill(white, 4 * (y * modules * side + x), 4 * (y * modules * side + x) + 3);
      }
    }
    return jsqr(pixels, modules * side, modules * side, { inversionAttempts: "dontInvert" })?.data;
  });
}

test("real networks come before virtual ones, IPv4 before IPv6, and no address that only this machine can open", () => {
  const found = lanAddresses(INTERFACES).map(({ address }) => address);
  assert.deepEqual(found, ["192.168.1.23", "10.0.0.7", "2001:db8::5", "172.17.0.1", "172.18.0.1", "169.254.3.4"]);
});

test("each address is printed, and a phone can read the code of each real network", () => {
  const words = lanWords(lanAddresses(INTERFACES), 8443);
  assert.deepEqual(addressesIn(words), [
    "https://192.168.1.23:8443/",
    "https://10.0.0.7:8443/",
    "https://[2001:db8::5]:8443/",
    "https://172.17.0.1:8443/",
    "https://172.18.0.1:8443/",
    "https://169.254.3.4:8443/",
  ]);
  assert.deepEqual(codesIn(words), ["https://192.168.1.23:8443/", "https://10.0.0.7:8443/"]);
  const onlyVirtual = lanWords(lanAddresses({ docker0: INTERFACES.docker0 }), 1);
  assert.deepEqual(codesIn(onlyVirtual), ["https://172.17.0.1:1/"]);
});

test("the certificate is for every address, for servers, for now and not for long, and new each time", async () => {
  const addresses = lanAddresses(INTERFACES);
  const [one, another] = [await makeCertificate(addresses), await makeCertificate(addresses)];
  const certificate = new X509Certificate(one.cert);
  for (const { address } of addresses) assert.equal(certificate.checkIP(address), address);
  assert.equal(certificate.checkHost("localhost"), "localhost");
  assert.equal(certificate.checkIP("192.168.1.24"), undefined);
  assert.deepEqual(certificate.keyUsage, ["1.3.6.1.5.5.7.3.1"]);
  assert.equal(certificate.ca, false);
  const [from, to] = [certificate.validFrom, certificate.validTo].map((date) => new Date(date).getTime());
  // Apple's devices refuse certificates of more than 398 days.
  assert.ok(from <= Date.now() && to > Date.now() && to - from < 398 * 86_400_000, `${certificate.validFrom} to ${certificate.validTo}`);
  assert.notEqual(one.key, another.key);
});

test("the page is there over https under its first address, with that certificate, and over http on this machine alone", { skip }, async () => {
  const [local] = text.split("\n");
  const [address] = addressesIn(text);
  assert.deepEqual(codesIn(text)[0], address);
  const { status, page, certificate } = await new Promise((resolve, reject) => {
    request(address, { rejectUnauthorized: false }, (response) => {
      const certificate = response.socket.getPeerX509Certificate();
      let page = "";
      response.on("data", (chunk) => (page += chunk));
      response.on("end", () => resolve({ status: response.statusCode, page, certificate }));
    })
      .on("error", reject)
      .end();
  });
  assert.equal(status, 200);
  assert.match(page, /<title>/);
  const { hostname } = new URL(address);
  assert.ok(certificate.checkIP(hostname), certificate.subjectAltName);
  const refused = await fetch(address).catch((error) => error);
  assert.match(String(refused.cause?.code), /SELF_SIGNED/, "nobody vouches for it");
  assert.equal((await fetch(local)).status, 200);
  const fromOutside = await fetch(local.replace("localhost", hostname)).catch((error) => error);
  assert.equal(fromOutside.cause?.code, "ECONNREFUSED");
});

test("without --lan the page is on this machine alone", { skip }, async () => {
  const alone = spawn(process.execPath, [join(WWW, "serve.mjs")], { stdio: ["ignore", "pipe", "inherit"] });
  try {
    const [line] = await once(alone.stdout, "data");
    const { port } = new URL(String(line));
    const [{ address, family }] = lanAddresses();
    const outside = `http://${family === "IPv6" ? `[${address}]` : address}:${port}/`;
    assert.equal((await fetch(outside).catch((error) => error)).cause?.code, "ECONNREFUSED");
  } finally {
    alone.kill();
  }
});

test("a port that is taken, and a machine without a network, are errors in words", async () => {
  const taken = createServer().listen(0, "::");
  await once(taken, "listening");
  const { port } = taken.address();
  const busy = spawnSync(process.execPath, [join(WWW, "serve.mjs"), "--lan", String(port)], { encoding: "utf8" });
  taken.close();
  assert.deepEqual([busy.status, busy.stdout], [1, ""]);
  assert.match(busy.stderr, new RegExp(`on port ${port}: .*EADDRINUSE`));
  assert.deepEqual(lanAddresses({ lo: networkInterfaces().lo ?? INTERFACES.lo }), []);
  const alone = `import os from "node:os"; import { syncBuiltinESMExports } from "node:module";
    os.networkInterfaces = () => ({}); syncBuiltinESMExports();`;
  const preload = `data:text/javascript,${encodeURIComponent(alone)}`;
  const none = spawnSync(process.execPath, ["--import", preload, join(WWW, "serve.mjs"), "--lan"], { encoding: "utf8" });
  assert.deepEqual([none.status, none.stdout], [1, ""]);
  assert.match(none.stderr, /this machine is in no network, so no phone can reach it/);
});
