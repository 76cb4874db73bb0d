// Has the site's service worker keep the page for later visits, offline too, for people who have come back.

import { VERSION } from "./version.js";

const SCRIPT = "service-worker.js";
/** Left by the first visit, which fetches what the person asks for and no more. */
const VISITED_KEY = "deepsft/visited";
/** After so long a newer version that could not take over, for another window was there, is asked again. */
const AGAIN_MS = 3000;

/**
 * Where there is a version to keep, and the person does not save data.
 *
 * @returns {() => void} puts a newer version in the place of this one, if it is there; to be called when nothing goes on, for the page
 *   then loads again
 */
export function workOffline() {
  const workers = navigator.serviceWorker;
  /** @type {{ saveData?: boolean } | undefined} */
  const connection = /** @type {any} */ (navigator).connection;
  if (VERSION === null || !workers || connection?.saveData || !(wasHere() || workers.controller)) return () => undefined;
  /** @type {ServiceWorkerRegistration | null} */
  let registration = null;
  let timer = 0;
  const update = () => {
    clearTimeout(timer);
    if (document.body.dataset.view !== "start" || !registration?.waiting) return;
    registration.waiting.postMessage("take-over");
    timer = window.setTimeout(update, AGAIN_MS);
  };
  const register = async () => {
    registration = await workers.register(SCRIPT, { updateViaCache: "none" });
    registration.addEventListener("updatefound", () => {
      const { installing } = /** @type {ServiceWorkerRegistration} */ (registration);
      installing?.addEventListener("statechange", update);
    });
    update();
    await registration.update().catch(() => forgetIfGone(registration));
  };
  if (workers.controller) workers.addEventListener("controllerchange", () => location.reload());
  // The page itself comes first.
  const begin = () => void register().catch(() => undefined);
  if (document.readyState === "complete") begin();
  else addEventListener("load", begin, { once: true });
  return update;
}

/** Whether this is not the first visit. */
function wasHere() {
  try {
    const before = localStorage.getItem(VISITED_KEY);
    localStorage.setItem(VISITED_KEY, "yes");
    return before !== null;
  } catch {
    // Without a memory each visit is the first.
    return false;
  }
}

/**
 * Another site, or one in the making, may have taken this one's place.
 *
 * @param {ServiceWorkerRegistration | null} registration
 */
async function forgetIfGone(registration) {
  const response = await fetch(SCRIPT, { cache: "no-store" }).catch(() => null);
  if (response?.status !== 404) return;
  await registration?.unregister();
  location.reload();
}
