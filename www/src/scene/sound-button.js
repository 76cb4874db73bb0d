// The button for the sound of films in a scene: browsers allow it to taps alone.

/** Is shown once a film has sound. */
export class SoundButton {
  #button = document.createElement("button");
  /** @type {HTMLVideoElement[]} */
  #films = [];

  /** @param {HTMLElement} element that it is laid over */
  constructor(element) {
    const button = Object.assign(this.#button, { type: "button", textContent: "Sound", hidden: true });
    button.setAttribute("aria-pressed", "false");
    Object.assign(button.style, {
      ...{ position: "absolute", right: "16px", top: "16px", minHeight: "44px", padding: "0 16px", border: "0", borderRadius: "22px", pointerEvents: "auto" },
      ...{ background: "rgb(16 19 22 / 0.75)", color: "#f2efe9", font: "16px system-ui, sans-serif", textDecoration: "line-through" },
    });
    button.addEventListener("click", () => {
      const isOn = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", String(isOn));
      button.style.textDecoration = isOn ? "" : "line-through";
      for (const film of this.#films) film.muted = !isOn;
    });
    element.append(button);
  }

  /** Offers the sound of films that have one. @param {HTMLVideoElement[]} films that are printed now */
  offer(films) {
    this.#films = films;
    this.#button.hidden = !films.some(hasSound);
  }
}

/** Whether a film has sound, where the browser tells; of the others only those that have played do. @param {HTMLVideoElement} video */
function hasSound(video) {
  const told = /** @type {{ mozHasAudio?: boolean, webkitAudioDecodedByteCount?: number, audioTracks?: { length: number } }} */ (/** @type {unknown} */ (video));
  return told.mozHasAudio ?? (told.audioTracks ? told.audioTracks.length > 0 : (told.webkitAudioDecodedByteCount ?? 1) > 0);
}
