/**
 * Parses server-sent events from text chunks by the WHATWG rules; comments are reported only as
 * signs of life.
 */
export interface ServerEvent {
  type: string;
  data: string;
  id: string | null;
}

export class EventParser {
  private rest = '';
  private type = '';
  private data: string[] = [];
  lastId: string | null = null;
  retryMs: number | null = null;

  push(text: string, onEvent: (event: ServerEvent) => void): void {
    const lines = (this.rest + text).split(/\r\n|\n|\r/);
    this.rest = lines.pop() ?? '';
    for (const line of lines) this.line(line, onEvent);
  }

  private line(line: string, onEvent: (event: ServerEvent) => void): void {
    if (line === '') {
      if (this.data.length)
        onEvent({ type: this.type || 'message', data: this.data.join('\n'), id: this.lastId });
      this.type = '';
      this.data = [];
      return;
    }
    if (line.startsWith(':')) return;
    const colon = line.indexOf(':');
    const field = colon < 0 ? line : line.slice(0, colon);
    const value = colon < 0 ? '' : line.slice(colon + 1).replace(/^ /, '');
    if (field === 'event') this.type = value;
    else if (field === 'data') this.data.push(value);
    else if (field === 'id') this.lastId = value;
    else if (field === 'retry' && /^\d+$/.test(value)) this.retryMs = Number(value);
  }
}
