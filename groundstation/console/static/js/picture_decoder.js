// A worker: a camera's JPEG comes in, its picture goes out, or null where it is none.

addEventListener("message", async ({ data: { name, jpeg } }) => {
  const bitmap = await createImageBitmap(new Blob([jpeg], { type: "image/jpeg" })).catch(() => null);
  postMessage({ name, bitmap }, bitmap ? [bitmap] : []);
});
