// The last picture, kept on this device. Where the browser keeps nothing (private windows, a full disk) the page does without.

/** @import { ReadyPicture } from "./picture-editor.js" */

/** With the flat print as a file; earlier versions kept no `hasSize`. @typedef {Omit<ReadyPicture, "canvas" | "hasSize"> & { picture: Blob, hasSize?: boolean }} KeptPicture */

const DATABASE = "deepsft-demo";
const STORE = "pictures";
const LAST = "last";

/**
 * @param {IDBRequest | IDBTransaction} work
 * @param {"success" | "complete"} end
 */
function done(work, end) {
  return new Promise((resolve, reject) => {
    work.addEventListener(end, resolve);
    for (const failure of ["error", "abort"]) work.addEventListener(failure, () => reject(work.error));
  });
}

/**
 * @template T
 * @param {IDBTransactionMode} mode
 * @param {(store: IDBObjectStore) => IDBRequest<T>} action
 * @returns {Promise<T | null>} null where the browser keeps nothing
 */
async function inStore(mode, action) {
  try {
    const opening = indexedDB.open(DATABASE, 1);
    opening.onupgradeneeded = () => opening.result.createObjectStore(STORE);
    await done(opening, "success");
    const transaction = opening.result.transaction(STORE, mode);
    const request = action(transaction.objectStore(STORE));
    await done(transaction, "complete").finally(() => opening.result.close());
    return request.result;
  } catch {
    return null;
  }
}

/** @returns {Promise<KeptPicture | null>} */
export async function lastPicture() {
  const kept = await inStore("readonly", (store) => store.get(LAST));
  const isWhole = kept?.picture instanceof Blob && kept.picture.size > 0 && kept.widthMm > 0 && kept.heightMm > 0;
  return isWhole ? kept : null;
}

/** @param {KeptPicture} picture takes the place of the one before */
export async function keepPicture(picture) {
  await inStore("readwrite", (store) => store.put(picture, LAST));
}

export async function forgetPicture() {
  await inStore("readwrite", (store) => store.delete(LAST));
}
