declare module '*.md' {
  const chapter: {
    title: string;
    sections: { id: string; title: string }[];
    /** Made from files of this repository when the page is built; never from what a user or a server sends. */
    html: string;
  };
  export default chapter;
}
