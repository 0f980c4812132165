// SPDX-License-Identifier: MIT
// The connection to compbox-view: what it sends, and whether it is there.

const ASK_MS = 2000; // a running box sends at least once a second; while it is silent, the server is asked
const PATIENCE_MS = 3000;

const now_s = () => performance.now() / 1000; // the viewer's wall clock may be wrong

/** out: the JSON behind this path; rejects if there is none in time. */
export async function get(path, patience_ms = 30000) {
  const reply = await fetch(path, { cache: "no-store", signal: AbortSignal.timeout(patience_ms) });
  if (!reply.ok) throw new Error(`${path}: ${reply.status}`);
  return reply.json();
}

/** Follows /api/stream, and opens it again after each loss. */
export class Live {
  /** handlers: opened() after each connection, live(state), event(line). */
  constructor(handlers) {
    this.handlers = handlers;
    this.state = null; // {snapshot, age_s, stale, why}, the newest
    this.heard_s = now_s();
    this.away = false; // the server did not reply to the last question
    this.open();
    // A browser keeps a page that was left, with its stream; ask() opens it again when the page comes back.
    addEventListener("pagehide", () => this.source.close());
    setInterval(() => this.ask(), ASK_MS);
  }

  open() {
    this.source?.close();
    this.source = new EventSource("api/stream");
    this.source.addEventListener("open", () => this.handlers.opened());
    this.source.addEventListener("live", message => this.take(JSON.parse(message.data)));
    this.source.addEventListener("event", message => this.handlers.event(JSON.parse(message.data)));
    this.source.addEventListener("error", () => this.ask());
  }

  take(state) {
    this.state = state;
    this.heard_s = now_s();
    this.away = false;
    this.handlers.live(state);
  }

  /** Asks for the state if the stream is silent, and opens the stream again if it has ended. */
  async ask() {
    const lost = this.source.readyState !== EventSource.OPEN;
    if (this.asking || (!lost && this.silence_s() < ASK_MS / 1000)) return;
    this.asking = true;
    try {
      this.take(await get("api/live", PATIENCE_MS));
      if (this.source.readyState === EventSource.CLOSED) this.open();
    } catch {
      this.away = true;
    }
    this.asking = false;
  }

  silence_s() {
    return now_s() - this.heard_s;
  }

  /** Age of the snapshot by now, s; without a snapshot, since the page was opened. */
  age_s() {
    return (this.state?.age_s ?? 0) + this.silence_s();
  }
}
