// The image on an oblique plane, sampled by the server.

/** Returns a function that an ObliquePlane calls for its codes; a new request to the server cancels the previous one. */
export function codesOf() {
  let controller = null;
  return async ({first, alongX, alongY, count}) => {
    controller?.abort();
    controller = new AbortController();
    try {
      const answer = await fetch(`/oblique?first=${first}&right=${alongX}&down=${alongY}&count=${count}`, {signal: controller.signal});
      return answer.ok ? new Uint16Array(await answer.arrayBuffer()) : null;
    } catch {
      return null;  // a newer request replaced it, or the connection is lost
    }
  };
}
