// Parts of the page that fail must not stop the others, least of all the alarms: what fails is told as one.

const failed = new Map();

// Runs one part of the page; returns whether it went well. It counts as failed until it does.
export function guarded(part, act) {
  try {
    act();
    failed.delete(part);
    return true;
  } catch (error) {
    if (failed.get(part) !== `${error}`) console.error(`${part}:`, error);
    failed.set(part, `${error}`);
    return false;
  }
}

export const failures = () => [...failed.keys()];
