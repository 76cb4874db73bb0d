// Which camera shows: a button that changes between two, a list where there are more. The choice is remembered for the next visit.

import { listCameras } from "deepsft";
import { part } from "../part.js";

/** @import { CameraStream, Facing, ListedCamera } from "deepsft" */

const KEY = "deepsft/camera";
/** @type {Record<Facing, string>} */
const FACING_WORDS = { environment: "Back camera", user: "Front camera" };

/** @returns {{ deviceId?: string, facing?: Facing }} the camera that was chosen last, for `openCamera` */
export function rememberedCamera() {
  try {
    return JSON.parse(localStorage.getItem(KEY) ?? "{}") ?? {};
  } catch {
    // Storage is blocked, or holds what somebody else wrote.
    return {};
  }
}

/** @param {CameraStream} stream */
function remember({ deviceId, facing }) {
  const choice = { ...(deviceId !== "" && { deviceId }), ...((facing === "user" || facing === "environment") && { facing }) };
  try {
    localStorage.setItem(KEY, JSON.stringify(choice));
  } catch {
    // It then lasts as long as the page.
  }
}

/**
 * What people call a camera: which way it looks where that says which it is, else its own name.
 *
 * @param {ListedCamera} camera
 * @param {ListedCamera[]} all
 */
export function nameOf(camera, all) {
  const { label, facing } = camera;
  const alike = all.filter((other) => other.facing === facing);
  if (facing !== "" && alike.length === 1) return FACING_WORDS[facing];
  // Chrome on Android: "camera2 2, facing back".
  if (facing !== "" && /^camera2? \d/.test(label)) return `${FACING_WORDS[facing]} ${alike.indexOf(camera) + 1}`;
  return label.replace(/\s*\([0-9a-f]{4}:[0-9a-f]{4}\)$/, "");
}

export class CameraSwitch {
  #root = part("#cameras");
  #button = part("#cameras button", HTMLButtonElement);
  #list = part("#cameras select", HTMLSelectElement);
  /** For a screen reader. */
  #said = part("#cameras [role=status]");
  #onNamed;
  #onFailed;
  /** @type {CameraStream | null} */
  #stream = null;
  /** @type {ListedCamera[]} */
  #cameras = [];

  /**
   * @param {(name: string) => void} onNamed is told what the camera is called that shows
   * @param {(error: unknown, name: string) => void} onFailed is told why the camera with this name does not show; the former one goes on
   */
  constructor(onNamed, onFailed) {
    this.#onNamed = onNamed;
    this.#onFailed = onFailed;
    this.#button.addEventListener("click", () => {
      const other = this.#cameras.find(({ deviceId }) => deviceId !== this.#stream?.deviceId);
      if (other) void this.#choose(other);
    });
    this.#list.addEventListener("change", () => void this.#choose(this.#cameras[this.#list.selectedIndex]));
    navigator.mediaDevices?.addEventListener?.("devicechange", () => void this.#show());
  }

  /** @param {CameraStream | null} stream that shows; null for none */
  async use(stream) {
    this.#stream = stream;
    this.#root.hidden = true;
    await this.#show();
  }

  async #show() {
    const stream = this.#stream;
    if (!stream) return;
    const cameras = await listCameras().catch(() => []);
    if (this.#stream !== stream) return;
    this.#cameras = cameras;
    const current = cameras.find(({ deviceId }) => deviceId === stream.deviceId);
    const name = current ? nameOf(current, cameras) : stream.label;
    this.#onNamed(name);
    this.#root.hidden = !current || cameras.length < 2;
    if (!current) return;
    const isPair = cameras.length === 2;
    this.#button.hidden = !isPair;
    this.#list.hidden = isPair;
    const [other] = cameras.filter((camera) => camera !== current);
    this.#button.setAttribute("aria-label", other ? `${name}. Change to: ${nameOf(other, cameras)}` : name);
    this.#button.title = this.#list.title = name;
    this.#list.replaceChildren(...cameras.map((camera) => new Option(nameOf(camera, cameras), "", false, camera === current)));
  }

  /** @param {ListedCamera} camera */
  async #choose(camera) {
    const stream = this.#stream;
    if (!stream) return;
    const name = nameOf(camera, this.#cameras);
    try {
      await stream.switchTo({ deviceId: camera.deviceId });
      remember(stream);
      this.#said.textContent = name;
    } catch (error) {
      // One that was lost tells so itself.
      if (this.#stream === stream && !stream.error) this.#onFailed(error, name);
    }
    await this.#show();
  }
}
