declare module '*.md' {
  const chapter: {
    title: string;
    sections: { id: string; title: string }[];
    /**
     * HTML: the text before the first section, then each section. Made from files of this
     * repository when the page is built; never from input of a user or a server.
     */
    parts: string[];
  };
  export default chapter;
}
