// A person's own picture or scan: from a file, the clipboard or the camera, to its size, to the library; the last one is kept.

import { DeepSftError } from "deepsft";
import { PictureError } from "../messages.js";
import { part } from "../part.js";
import { Capture } from "./capture.js";
import { onChosen } from "./given-files.js";
import { PictureEditor } from "./picture-editor.js";
import { forgetPicture, keepPicture, lastPicture } from "./picture-store.js";
import { formatSize } from "./print-size.js";
import { ScanEditor } from "./scan-editor.js";
import { MAX_PICTURE_LENGTH, readPicture, shrunk } from "./read-picture.js";

/** @import { Scan } from "deepsft" */
/** @import { ReadyPicture } from "./picture-editor.js" */
/** @import { Corners } from "./corner-editor.js" */
/** @import { OpenedPicture } from "./read-picture.js" */

/** Longest side of the small picture on the start screen, CSS pixels, twice for dense screens. */
const THUMBNAIL_LENGTH = 2 * 116;
const JPEG_QUALITY = 0.95;

/** Scans, and what people take for one: the library says what to do with those. */
const SCAN_NAMES = [/\.(glb|gltf|obj|ply)$/i, /\.(mtl|stl|usdz?|fbx|dae|3ds|blend|zip)$/i];

/** The file that is a scan, if one of these is. @param {File[]} files */
export function scanAmong(files) {
  return SCAN_NAMES.map((kind) => files.find(({ name }) => kind.test(name))).find(Boolean);
}

/**
 * What the page does about it.
 *
 * @typedef {object} OwnPicturePage
 * @property {() => void} show shows the person's own picture
 * @property {() => void} leave goes back to the start
 * @property {(picture: ReadyPicture, use: "camera" | "image") => void} use looks for it
 * @property {(files: File[]) => Promise<Scan>} readScan reads a scan's files
 * @property {(error: unknown, again: () => void) => void} fail says what is in the way, and offers what was tried `again`
 */

export class OwnPicture {
  #root = part("#own");
  #page;
  #capture = new Capture();
  #editor = new PictureEditor();
  #scan = new ScanEditor();
  #file = part("#picture-file", HTMLInputElement);
  #scanFile = part("#scan-file", HTMLInputElement);
  /** @type {ReadyPicture | null} the last one */
  #last = null;
  /** Number of the newest picture, so that one that took longer to read does not take its place. */
  #newest = 0;

  /** @param {OwnPicturePage} page */
  constructor(page) {
    this.#page = page;
    this.#capture.onPicture = (picture, corners) => this.#edit(picture, corners);
    this.#capture.onError = (error) => page.fail(error, () => this.photograph());
    for (const editor of [this.#editor, this.#scan]) editor.onReady = (picture, use) => void this.#finish(picture, use);
    for (const leave of this.#root.querySelectorAll(".leave")) leave.addEventListener("click", page.leave);
    part("#choose-picture").addEventListener("click", () => this.#file.click());
    part("#photograph").addEventListener("click", () => this.photograph());
    for (const id of ["#choose-scan", "#another-scan"]) part(id).addEventListener("click", () => this.#scanFile.click());
    part("#last-use").addEventListener("click", () => this.#last && page.use(this.#last, "camera"));
    part("#last-edit").addEventListener("click", () => this.edit());
    part("#last-forget").addEventListener("click", () => void this.#forget());
    onChosen(this.#file, ([file]) => void this.read(file));
    onChosen(this.#scanFile, (files) => void this.readScan(files));
    this.#root.addEventListener("keydown", (event) => event.key === "Escape" && page.leave());
    void this.#recall();
  }

  /** Opens the camera for a photograph of the print. */
  photograph() {
    this.#newest++;
    this.#show();
    void this.#capture.open();
  }

  /** @param {File} file */
  async read(file) {
    const own = ++this.#newest;
    try {
      const picture = await readPicture(file);
      if (own === this.#newest) this.#edit(picture);
    } catch (error) {
      if (own === this.#newest) this.#page.fail(error, () => this.#file.click());
    }
  }

  /** @param {File[]} files of one scan */
  async readScan(files) {
    const own = ++this.#newest;
    this.#show();
    this.#scan.wait(scanAmong(files)?.name ?? files[0].name);
    try {
      const scan = await this.#page.readScan(files);
      if (own === this.#newest) this.#scan.open(scan);
    } catch (error) {
      if (own !== this.#newest) return;
      const isBroken = error instanceof DeepSftError && error.code === "target-unusable";
      this.#page.fail(isBroken ? new PictureError("scan-unusable", error.message, { cause: error }) : error, () => this.#scanFile.click());
    }
  }

  /** Goes back to the last picture, to change its size or to crop it. */
  edit() {
    if (!this.#last) return this.#file.click();
    const { canvas, name, widthMm, hasSize } = this.#last;
    this.#show();
    this.#editor.open({ canvas, name, transparent: false }, { widthMm, hasSize });
  }

  close() {
    this.#newest++;
    this.#closeAll();
    this.#root.hidden = true;
  }

  #closeAll() {
    for (const screen of [this.#capture, this.#editor, this.#scan]) screen.close();
  }

  /** The page shows the person's own picture, for which one of the screens is opened next. */
  #show() {
    this.#page.show();
    this.#closeAll();
  }

  /**
   * @param {OpenedPicture} picture
   * @param {Corners} [corners] of the print, nearly, in a photograph of it
   */
  #edit(picture, corners) {
    this.#show();
    this.#editor.open(picture, { corners });
  }

  /**
   * @param {ReadyPicture} picture
   * @param {"camera" | "image"} use
   */
  async #finish(picture, use) {
    this.#showLast(picture);
    // Before anything is waited for: browsers open file dialogs only right after a click.
    this.#page.use(picture, use);
    const { canvas, ...rest } = picture;
    const blob = await new Promise((/** @type {(blob: Blob | null) => void} */ resolve) =>
      canvas.toBlob(resolve, "image/jpeg", JPEG_QUALITY),
    );
    if (blob && this.#last === picture) await keepPicture({ picture: blob, ...rest });
  }

  async #recall() {
    const kept = await lastPicture();
    const bitmap = kept && (await createImageBitmap(kept.picture).catch(() => null));
    if (!kept || !bitmap) return;
    const canvas = shrunk(bitmap, MAX_PICTURE_LENGTH);
    bitmap.close();
    const { name, widthMm, heightMm, hasSize = true } = kept;
    if (!this.#last) this.#showLast({ canvas, name, widthMm, heightMm, hasSize });
  }

  async #forget() {
    this.#last = null;
    part("#last").hidden = true;
    part("#choose-picture").focus();
    await forgetPicture();
  }

  /** @param {ReadyPicture} picture */
  #showLast(picture) {
    this.#last = picture;
    const { canvas, name, widthMm, heightMm, hasSize } = picture;
    shrunk(canvas, THUMBNAIL_LENGTH, part("#last-picture", HTMLCanvasElement));
    part("#last-name").textContent = name;
    part("#last-size").textContent = hasSize ? formatSize(widthMm, heightMm) : "Size not known";
    part("#last").hidden = false;
  }
}
