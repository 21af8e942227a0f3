declare module '*.md' {
  const chapter: {
    title: string;
    sections: { id: string; title: string }[];
    /**
     * HTML: what stands before the first section, then each section. Made from files of this
     * repository when the page is built; never from what a user or a server sends.
     */
    parts: string[];
  };
  export default chapter;
}
