/** Which version of the site this is; null where the page works without a service worker. site.mjs writes it anew. @type {string | null} */
export const VERSION = null;
