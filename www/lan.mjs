// The development server for the other devices of the network: where they find it, a certificate, and what a person reads in the terminal.
// Browsers give pages a camera only over https, so there has to be a certificate; nobody vouches for one that is made on the spot.

import { hostname, networkInterfaces } from "node:os";
import { generate } from "selfsigned";
import { renderUnicodeCompact } from "uqr";

/** What containers, virtual machines and tunnels call their networks: a phone is seldom in one. */
const VIRTUAL = /^(docker|br-|veth|virbr|vmnet|vmenet|vboxnet|vethernet|bridge|lxc|lxd|cni|flannel|podman|utun|tun|tap|wg|tailscale|zt|ppp|awdl|llw)/i;
/** Addresses that an interface gives itself where nobody gives it one. */
const SELF_ASSIGNED = /^169\.254\./;
const CERTIFICATE_DAYS = 30;
const DAY_MS = 86_400_000;

/** White on black, whatever the terminal's own colours are: some phones read no code of light squares. */
const [PAINT, UNPAINT] = ["\x1b[97;40m", "\x1b[0m"];

/** @typedef {{ address: string, family: "IPv4" | "IPv6", network: string, isVirtual: boolean }} LanAddress */

/**
 * Where other devices find this machine, the likeliest first: real networks before virtual ones, IPv4 before IPv6, which is longer to type.
 * Link-local IPv6 addresses are left out, for no browser opens them.
 *
 * @param {ReturnType<typeof networkInterfaces>} [interfaces]
 * @returns {LanAddress[]}
 */
export function lanAddresses(interfaces = networkInterfaces()) {
  const all = Object.entries(interfaces).flatMap(([network, addresses = []]) =>
    addresses
      .filter(({ internal, address }) => !internal && !/^fe[89ab]/i.test(address))
      .map(({ address, family }) => ({ address, family, network, isVirtual: VIRTUAL.test(network) || SELF_ASSIGNED.test(address) })),
  );
  const rank = ({ family, isVirtual }) => 2 * Number(isVirtual) + Number(family === "IPv6");
  return all.sort((a, b) => rank(a) - rank(b));
}

/**
 * A certificate for this machine's names, with its key. Neither is ever written to a file.
 *
 * @param {LanAddress[]} addresses
 * @returns {Promise<{ key: string, cert: string }>} PEM
 */
export async function makeCertificate(addresses) {
  const ips = ["127.0.0.1", "::1", ...addresses.map(({ address }) => address)];
  const altNames = [...["localhost", hostname()].map((value) => ({ type: 2, value })), ...ips.map((ip) => ({ type: 7, ip }))];
  // An hour before now: the clock of the phone may be behind.
  const notBeforeDate = new Date(Date.now() - DAY_MS / 24);
  const made = await generate([{ name: "commonName", value: "deepsft demo, made on the spot" }], {
    keyType: "ec",
    algorithm: "sha256",
    notBeforeDate,
    notAfterDate: new Date(notBeforeDate.getTime() + CERTIFICATE_DAYS * DAY_MS),
    extensions: [
      { name: "basicConstraints", cA: false, critical: true },
      { name: "keyUsage", digitalSignature: true, critical: true },
      { name: "extKeyUsage", serverAuth: true },
      { name: "subjectAltName", altNames },
    ],
  });
  return { key: made.private, cert: made.cert };
}

/**
 * What a person reads who wants the page on a phone.
 *
 * @param {LanAddress[]} addresses at least one
 * @param {number} port
 * @returns {string}
 */
export function lanWords(addresses, port) {
  const urlOf = ({ address, family }) => `https://${family === "IPv6" ? `[${address}]` : address}:${port}/`;
  const line = (lan) => `    ${urlOf(lan)}   (${lan.network})`;
  // A code for each network; a phone is in one of them.
  const isFirst = (lan) => addresses.find(({ network }) => network === lan.network) === lan;
  const coded = addresses.filter((lan) => isFirst(lan) && (!lan.isVirtual || lan === addresses[0]));
  const others = addresses.filter((lan) => !coded.includes(lan));
  return [
    "Open the page on a phone that is in the same network, by its address or by the code:",
    ...coded.flatMap((lan) => ["", line(lan), "", painted(renderUnicodeCompact(urlOf(lan), { border: 2 }))]),
    ...(others.length > 0 ? ["", "Where that does not open:", "", ...others.map(line)] : []),
    "",
    "The phone will say that the connection is not private: the certificate was made on this machine a moment ago, and nobody",
    "vouches for it. What you send is encrypted all the same. Go on in",
    "    Safari    Show Details, then visit this website",
    "    Chrome    Advanced, then Proceed",
    "    Firefox   Advanced, then Accept the Risk and Continue",
    "The next start makes another certificate, and the phone asks again.",
    "",
    "As long as this runs, everybody in this network can open the page. Pictures stay on the device that takes them.",
  ].join("\n");
}

/** @param {string} code */
function painted(code) {
  return code
    .split("\n")
    .map((line) => `    ${PAINT}${line}${UNPAINT}`)
    .join("\n");
}
