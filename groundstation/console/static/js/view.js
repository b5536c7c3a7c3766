// World to canvas and back; pan by dragging, zoom by wheel, pinch and buttons.

export class View {
  constructor(canvas, changed) {
    Object.assign(this, { canvas, changed, x: 0, y: 0, scale: 80, width: 1, height: 1, fitted: true });
    this.room = [8, 6];
    new ResizeObserver(() => this.resize()).observe(canvas);
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.zoom(Math.exp(-event.deltaY * 0.0015), event.offsetX, event.offsetY); }, { passive: false });
  }

  resize() {
    const ratio = Math.min(2, devicePixelRatio || 1);
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight) return;
    Object.assign(this, { width: clientWidth, height: clientHeight, ratio });
    this.canvas.width = Math.round(clientWidth * ratio);
    this.canvas.height = Math.round(clientHeight * ratio);
    if (this.fitted) this.fit();
    this.changed();
  }

  fit() {
    this.scale = Math.min((this.width - 70) / this.room[0], (this.height - 84) / this.room[1]);
    Object.assign(this, { x: 0, y: 0, fitted: true });
    this.changed();
  }

  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [wx, wy] = this.world(px, py);
    this.scale = Math.min(1200, Math.max(15, this.scale * factor));
    const [qx, qy] = this.world(px, py);
    this.x += wx - qx; this.y += wy - qy;
    this.fitted = false;
    this.changed();
  }

  pan(dx, dy) {
    this.x -= dx / this.scale; this.y += dy / this.scale;
    this.fitted = false;
    this.changed();
  }

  point(wx, wy) { return [this.width / 2 + (wx - this.x) * this.scale, this.height / 2 - (wy - this.y) * this.scale]; }
  world(px, py) { return [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale]; }
}
