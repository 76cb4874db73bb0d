// Files of models that this browser has fetched before, kept in its Cache storage by their SHA-256.

const CACHE = "deepsft-models";

/**
 * Kept files of one folder. What cannot be kept is fetched each time: without Cache storage (insecure pages, sandboxed frames, some private windows),
 * without room, or where it is not wanted. No failure of the storage is an error.
 */
export class KeptFiles {
  #folder;
  /** @type {Cache | null} */
  #cache = null;

  /** @param {URL} folder of the files */
  constructor(folder) {
    this.#folder = folder;
  }

  /** Opens the storage, before which nothing is there. */
  async open() {
    try {
      // Without hashes none would be known again. In a sandboxed frame to ask for the storage is an error already.
      if (crypto.subtle) this.#cache = await caches.open(CACHE);
    } catch {
      // Each file is fetched.
    }
  }

  /**
   * A kept file; null where there is none, or one that is damaged, in whose place a good one is kept then.
   *
   * @param {string} name
   * @param {string} sha256 of its content, hexadecimal
   */
  async take(name, sha256) {
    try {
      const response = await this.#cache?.match(this.#key(name, sha256));
      const bytes = response && new Uint8Array(await response.arrayBuffer());
      return bytes && (await hasHash(bytes, sha256)) ? bytes : null;
    } catch {
      // A storage that fails is one that holds nothing.
      return null;
    }
  }

  /**
   * Keeps a file, if it is what it should be.
   *
   * @param {string} name
   * @param {string} sha256
   * @param {Uint8Array<ArrayBuffer>} bytes
   */
  async keep(name, sha256, bytes) {
    if (!this.#cache || !(await hasHash(bytes, sha256))) return;
    await this.#cache.put(this.#key(name, sha256), new Response(bytes)).catch(() => undefined);
  }

  /**
   * Throws away what the model held before. Folders that it has no file in now may be another model's.
   *
   * @param {Map<string, { sha256: string | null }>} files that the model holds now, by name
   */
  async dropOthers(files) {
    const current = new Set([...files].map(([name, { sha256 }]) => this.#key(name, sha256)));
    const folderOf = (/** @type {string} */ url) => new URL(".", url).href;
    const folders = new Set([...current, this.#key("", "")].map(folderOf));
    try {
      for (const { url } of (await this.#cache?.keys()) ?? [])
        if (folders.has(folderOf(url)) && !current.has(url)) await this.#cache?.delete(url);
    } catch {
      // The browser throws it away itself when it needs the room.
    }
  }

  /**
   * @param {string} name
   * @param {string | null} sha256
   */
  #key(name, sha256) {
    return new URL(`${name}?sha256=${sha256}`, this.#folder).href;
  }
}

/**
 * @param {Uint8Array<ArrayBuffer>} bytes
 * @param {string} sha256 hexadecimal
 */
export async function hasHash(bytes, sha256) {
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", bytes));
  return Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("") === sha256;
}
