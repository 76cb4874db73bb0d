// What a person reads when something is in the way, by error code, and what they can do next.

import { DeepSftError } from "deepsft";

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
 * @typedef {object} Message
 * @property {string} title
 * @property {string} advice "{reason}" in it stands for what the error says
 * @property {Remedy[]} remedies
 */

/** @type {Readonly<Record<string, Message>>} */
const MESSAGES = {
  "camera-denied": {
    title: "The camera was not allowed",
    advice: "Allow it for this site in the browser's settings, then try again. The picture stays on this device either way.",
    remedies: ["retry", "clip", "image"],
  },
  "camera-blocked": {
    title: "This page may not use the camera",
    advice: "The page around it, or the server, does not allow it. Open this page in a tab of its own.",
    remedies: ["clip", "image"],
  },
  "camera-unsupported": {
    title: "No camera in this browser",
    advice: "Apps that show pages often keep the camera from them. Open this page in a browser of its own.",
    remedies: ["clip", "image"],
  },
  "play-refused": {
    title: "The picture does not play",
    advice: "The browser waits for a tap before it plays anything.",
    remedies: ["retry", "clip", "image"],
  },
  "camera-not-found": {
    title: "No camera found",
    advice: "Plug one in and try again, or go on without one.",
    remedies: ["retry", "clip", "image"],
  },
  "camera-busy": {
    title: "The camera is busy",
    advice: "Another program or tab is using it. Close that one, then try again.",
    remedies: ["retry", "clip", "image"],
  },
  "camera-constraints": {
    title: "This camera does not fit",
    advice: "This camera offers no image size that the page can use.",
    remedies: ["clip", "image"],
  },
  "camera-lost": {
    title: "The camera stopped",
    advice: "{reason}",
    remedies: ["retry", "clip", "image"],
  },
  "insecure-context": {
    title: "No camera on this address",
    advice: "Browsers give pages a camera only over https or from localhost. The clip and images work here too.",
    remedies: ["clip", "image"],
  },
  "image-unreadable": {
    title: "This picture could not be read",
    advice: "{reason}",
    remedies: ["image", "clip"],
  },
  "picture-small": {
    title: "This picture is too small",
    advice: "It has too few pixels to be told from others. Take a larger copy of it, or photograph the print.",
    remedies: ["picture"],
  },
  "picture-empty": {
    title: "Nothing to be seen in this picture",
    advice: "Every pixel of it is see-through. Export it with its background, or photograph the print.",
    remedies: ["picture"],
  },
  "scan-unusable": {
    title: "This scan cannot be used",
    advice: "{reason} A .glb has everything in one file. An .obj comes with its .mtl and pictures: choose them together.",
    remedies: ["scan"],
  },
  "target-unusable": {
    title: "This picture cannot be recognised",
    advice: "A camera needs corners and edges to tell it by. Pictures with plenty of detail all over work best.",
    remedies: ["picture", "edit"],
  },
  "model-load": {
    title: "The model could not be fetched",
    advice: "Check the connection to the server this page came from, then try again.",
    remedies: ["retry"],
  },
  "model-corrupt": {
    title: "The model is damaged",
    advice:
      "The downloaded files do not match their checksums, so the page does not use them. Try again. If it fails again, the files on the server need replacing.",
    remedies: ["retry"],
  },
  "model-version": {
    title: "The model is newer than this page",
    advice: "Reload the page to get the version that understands it.",
    remedies: ["reload"],
  },
  "browser-unsupported": {
    title: "This browser lacks what the engine needs",
    advice: "A newer one has it: Chrome or Edge 100, Firefox 114, Safari 16.4, or later. Some protected modes switch it off.",
    remedies: ["reload"],
  },
  "engine-load": {
    title: "The engine could not be loaded",
    advice: "Check the connection to the server this page came from, then try again.",
    remedies: ["retry", "reload"],
  },
  "webgpu-unavailable": {
    title: "No WebGPU here",
    advice: "This page was asked to use WebGPU and nothing else, which this browser does not offer.",
    remedies: ["reload"],
  },
  "gpu-lost": {
    title: "The graphics processor gave up",
    advice: "It was started again, and failed again and again. Reloading the page usually helps.",
    remedies: ["reload"],
  },
};

/** @type {Message} */
const UNEXPECTED = {
  title: "Something broke",
  advice: "That is a defect of this page. Reloading it may help.",
  remedies: ["reload"],
};

/** Remedies while a person's own picture is looked for, which no clip shows. @type {Partial<Record<Remedy, Remedy>>} */
const FOR_OWN_PICTURE = { clip: "picture" };

/**
 * @param {unknown} error
 * @param {boolean} ownPicture whether a person's own picture is looked for
 */
export function messageFor(error, ownPicture) {
  const code = error instanceof DeepSftError || error instanceof PictureError ? error.code : "internal";
  const { title, advice, remedies } = MESSAGES[code] ?? UNEXPECTED;
  const detail = error instanceof Error ? error.message : String(error);
  return {
    title,
    advice: advice.replace("{reason}", () => detail),
    remedies: ownPicture ? remedies.map((remedy) => FOR_OWN_PICTURE[remedy] ?? remedy) : remedies,
    code,
    detail,
  };
}
