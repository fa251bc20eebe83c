// Whose turn it is: streams of what is laid over another share one connection, and hear of all that was meanwhile.
//
// To a service without TLS, which speaks HTTP/1.1, a browser opens six connections, and a stream keeps one for as long as
// its plan runs: with five laid over the one in front, none would be left to ask for anything.

/** How long one is open while others wait. */
const TURN_MS = 1000;

const waiting = [];
let open = null;
let timer;

/** Calls `stream.begin()` when its turn has come, and `stream.pause()` when it is over; then it waits for the next. */
export function queue(stream) {
  waiting.push(stream);
  next();
}

/** Its turn counts from here: on a slow line it takes a while to open. */
export function begun(stream) {
  if (stream !== open) return;
  clearTimeout(timer);
  timer = setTimeout(pass, TURN_MS);
}

/** Wants no more turns. */
export function leave(stream) {
  const at = waiting.indexOf(stream);
  if (at >= 0) waiting.splice(at, 1);
  if (stream !== open) return;
  clearTimeout(timer);
  open = null;
  next();
}

function next() {
  if (open || !waiting.length) return;
  open = waiting.shift();
  open.begin();
}

function pass() {
  if (!waiting.length) {
    timer = setTimeout(pass, TURN_MS);
    return;
  }
  open.pause();
  waiting.push(open);
  open = null;
  next();
}
