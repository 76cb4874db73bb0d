// The poster on the screen of a desktop, with a code that brings a phone to it.

import { part } from "./part.js";

/** Names that a computer has for itself alone. */
const LOOPBACK = /^(localhost|127\.|\[::1\])/;

/** Shows both; they are fetched now. */
export async function showOnScreen() {
  const poster = part("#screen-poster", HTMLImageElement);
  poster.src = "models/poster-a4/template/texture.png";
  const address = new URL("#poster", location.href).href;
  const isHere = LOOPBACK.test(location.hostname);
  part("#screen-address").textContent = isHere ? "This address is your computer's alone. For a phone in its network serve the page with --lan." : address;
  part("#screen", HTMLDialogElement).showModal();
  const { renderSVG } = await import("uqr");
  part("#screen-code", HTMLImageElement).src = `data:image/svg+xml,${encodeURIComponent(renderSVG(address))}`;
  await poster.decode();
  const { width } = part("#screen-size").getBoundingClientRect();
  const percent = Math.round((100 * poster.width) / width);
  part("#screen-note").textContent = percent < 99 ? `At ${percent} % of its size: distances seem so much larger.` : "";
}
