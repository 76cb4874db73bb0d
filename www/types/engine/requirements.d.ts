/**
 * Refuses a browser that the engine cannot run in, before anything is fetched.
 *
 * @throws {DeepSftError} `browser-unsupported`
 */
export declare function requireBrowser(): void;
