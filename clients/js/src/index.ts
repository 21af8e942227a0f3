/** Client of the Tessera render server, for browsers and Node 18. */
export * from './client.js';
export * from './errors.js';
export { FrameParser, type TileFrame } from './frames.js';
export type { Follow, FollowTiles, JobEvent } from './streams.js';
export type * from './types.js';
