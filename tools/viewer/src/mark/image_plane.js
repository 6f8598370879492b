// The image on a plane of any direction, as the server samples it.

/** For an ObliquePlane: of one that is turned on the newest counts. */
export function codesOf() {
  let controller = null;
  return async ({first, alongX, alongY, count}) => {
    controller?.abort();
    controller = new AbortController();
    try {
      const answer = await fetch(`/oblique?first=${first}&right=${alongX}&down=${alongY}&count=${count}`, {signal: controller.signal});
      return answer.ok ? new Uint16Array(await answer.arrayBuffer()) : null;
    } catch {
      return null;  // another one is wanted, or the connection is lost
    }
  };
}
