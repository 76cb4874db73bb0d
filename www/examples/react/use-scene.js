// A hook of React: a scene that fills an element while its component is mounted. Strict mode mounts twice; the first scene is then closed
// before it has started.

import { useEffect, useRef, useState } from "react";
import { start } from "deepsft/scene";

/** `ref` is for the element that the scene fills; `ar` is the scene, once it has started. */
export function useScene({ picture, widthMm }) {
  const ref = useRef(null);
  const [state, setState] = useState({ ar: null, error: null });
  useEffect(() => {
    const leaving = new AbortController();
    start(ref.current, { picture, widthMm, signal: leaving.signal }).then(
      (ar) => setState({ ar, error: null }),
      (error) => leaving.signal.aborted || setState({ ar: null, error }),
    );
    return () => leaving.abort();
  }, [picture, widthMm]);
  return { ref, ...state };
}
