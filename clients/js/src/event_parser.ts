/** Parses server-sent events from text chunks by the WHATWG rules, without their comments. */
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

  /** The events that the text completes. */
  push(text: string): ServerEvent[] {
    const lines = (this.rest + text).split(/\r\n|\n|\r/);
    this.rest = lines.pop() ?? '';
    return lines.flatMap((line) => this.line(line));
  }

  private line(line: string): ServerEvent[] {
    if (line === '') {
      const { type, data } = this;
      this.type = '';
      this.data = [];
      return data.length
        ? [{ type: type || 'message', data: data.join('\n'), id: this.lastId }]
        : [];
    }
    const colon = line.indexOf(':');
    const field = colon < 0 ? line : line.slice(0, colon);
    const value = colon < 0 ? '' : line.slice(colon + 1).replace(/^ /, '');
    if (field === 'event') this.type = value;
    else if (field === 'data') this.data.push(value);
    else if (field === 'id') this.lastId = value;
    else if (field === 'retry' && /^\d+$/.test(value)) this.retryMs = Number(value);
    return [];
  }
}
