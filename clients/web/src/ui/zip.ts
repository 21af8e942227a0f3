/** Zip archives of already compressed files: entries are stored uncompressed. */

const crcTable = Uint32Array.from({ length: 256 }, (_, n) => {
  for (let bit = 0; bit < 8; ++bit) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
  return n;
});

/** CRC-32 of ISO 3309, as used by zip (APPNOTE 4.4.7). */
export function crc32(bytes: Uint8Array): number {
  let crc = 0xffffffff;
  for (const byte of bytes) crc = crcTable[(crc ^ byte) & 0xff] ^ (crc >>> 8);
  return (crc ^ 0xffffffff) >>> 0;
}

function record(signature: number, fields: [bytes: 2 | 4, value: number][]): Uint8Array {
  const out = new DataView(new ArrayBuffer(4 + fields.reduce((sum, [size]) => sum + size, 0)));
  out.setUint32(0, signature, true);
  let at = 4;
  for (const [size, value] of fields) {
    if (size === 2) out.setUint16(at, value, true);
    else out.setUint32(at, value, true);
    at += size;
  }
  return new Uint8Array(out.buffer);
}

/** APPNOTE 4.3.7, 4.3.12 and 4.3.16; bit 11: names are UTF-8. The date is zip's first day. */
export function zipOf(files: { name: string; bytes: Uint8Array }[]): Blob {
  const parts: Uint8Array[] = [];
  const directory: Uint8Array[] = [];
  let offset = 0;
  for (const { name, bytes } of files) {
    const text = new TextEncoder().encode(name);
    const common: [2 | 4, number][] = [
      [2, 20],
      [2, 1 << 11],
      [2, 0],
      [2, 0],
      [2, (1 << 5) | 1],
      [4, crc32(bytes)],
      [4, bytes.length],
      [4, bytes.length],
      [2, text.length],
      [2, 0],
    ];
    const head = record(0x04034b50, common);
    directory.push(
      record(0x02014b50, [[2, 20], ...common, [2, 0], [2, 0], [2, 0], [4, 0], [4, offset]]),
      text,
    );
    parts.push(head, text, bytes);
    offset += head.length + text.length + bytes.length;
  }
  const size = directory.reduce((sum, part) => sum + part.length, 0);
  const end = record(0x06054b50, [
    [2, 0],
    [2, 0],
    [2, files.length],
    [2, files.length],
    [4, size],
    [4, offset],
    [2, 0],
  ]);
  return new Blob([...parts, ...directory, end] as BlobPart[], { type: 'application/zip' });
}

/** Makes names unique: "glass.png", "glass 2.png". */
export function distinct(names: string[], extension: string): string[] {
  const seen = new Set<string>();
  return names.map((name) => {
    const plain = name.replace(/[\\/:*?"<>|\x00-\x1f]/g, '-').trim() || 'render';
    let unique = plain;
    for (let n = 2; seen.has(unique.toLowerCase()); ++n) unique = `${plain} ${n}`;
    seen.add(unique.toLowerCase());
    return `${unique}.${extension}`;
  });
}
