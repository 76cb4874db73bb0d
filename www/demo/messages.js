// What a person reads when something is in the way, and what they can do next. The words are in index.html.

import { DeepSftError } from "deepsft";
import { part } from "./part.js";

/** @typedef {"retry" | "clip" | "image" | "reload" | "picture" | "edit" | "scan"} Remedy */

/** What is wrong with a picture before the library sees it. */
export class PictureError extends Error {
  /**
   * @param {"image-unreadable" | "picture-small" | "picture-empty" | "scan-unusable"} code
   * @param {string} message
   * @param {ErrorOptions} [options]
   */
  constructor(code, message, options) {
    super(message, options);
    this.code = code;
  }
}

/**
 * What the page says of an error, and what can be done.
 *
 * @param {unknown} error
 * @param {boolean} ownPicture whether a person's own picture is looked for
 */
export function messageFor(error, ownPicture) {
  const code = error instanceof DeepSftError || error instanceof PictureError ? error.code : "internal";
  const detail = error instanceof Error ? error.message : String(error);
  const { content } = part("#messages", HTMLTemplateElement);
  // What is none of these is a defect of the page.
  const [message] = [code, "internal"].flatMap((code) => content.querySelector(`[data-code="${code}"]`) ?? []);
  const [title, advice] = [...message.children].map(({ textContent }) => textContent?.replace("{reason}", () => detail) ?? "");
  const remedies = /** @type {Remedy[]} */ (message.getAttribute("data-remedies")?.split(" "));
  // No clip shows a person's own picture.
  return { title, advice, remedies: remedies.map((remedy) => (ownPicture && remedy === "clip" ? "picture" : remedy)), code, detail };
}
