// A component that shows a film on a poster.

import { useEffect } from "react";
import { useScene } from "./use-scene.js";

export function Poster({ picture, film }) {
  const { ref, ar, error } = useScene({ picture });
  useEffect(() => void ar?.sheet().print(film).catch(console.error), [ar, film]);
  return <div ref={ref} style={{ height: 360 }} data-error={error?.code} />;
}
