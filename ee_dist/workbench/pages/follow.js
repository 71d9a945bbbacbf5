// The robot in 3-D goes to the instant that the mouse points at in a chart. The viewer's own control takes a protobuf message:
// SetTimeCursor (field 6) with the timeline's name (2.1) and the time in nanoseconds (3.1), as rerun 0.41 has it. A viewer that does
// not know it says so in a promise, which is let go: then the robot stays where it is.
// robotOn: the timeline of the recording, and when on it the trial begins that the charts show.
window.robotOn = null;
window.robotAt = (seconds) => {
  const viewer = document.querySelector("iframe.robot")?.contentWindow?._handle;
  if (!viewer?.viewer_control || !window.robotOn) return;
  if (window.robotBusy) { window.robotNext = seconds; return; }
  const [name, begin] = window.robotOn, instant = BigInt(Math.max(0, Math.round((begin + seconds) * 1e9)));
  const number = (n) => (n > 127n ? [Number(n & 127n) | 128, ...number(n >> 7n)] : [Number(n)]);
  const part = (field, bytes) => [(field << 3) | 2, bytes.length, ...bytes];
  const timeline = part(1, [...new TextEncoder().encode(name)]);
  const time = [8, ...number(instant)];
  window.robotBusy = true;
  viewer.viewer_control(new Uint8Array(part(6, [...part(2, timeline), ...part(3, time)]))).catch(() => {}).finally(() => {
    const next = window.robotNext;
    window.robotBusy = false; window.robotNext = undefined;
    if (next !== undefined) window.robotAt(next);
  });
};
