// Plots of the last figures: lines, or layers upon each other.

const LENGTH = 120;
const COLORS = ['#5b8fc9', '#e39a5c', '#6fb58c', '#d0726f', '#9684c4', '#dcbf62', '#5fb3bb', '#c08aa8'];

export class Plot {
  // stacked: values are parts of a whole.
  constructor(canvas, legend, { stacked = false } = {}) {
    Object.assign(this, { canvas, legend, stacked, rows: [], names: [] });
  }

  add(values) {
    for (const name of Object.keys(values)) {
      if (this.names.includes(name)) continue;
      const color = COLORS[this.names.length % COLORS.length];
      const entry = document.createElement('span'), patch = document.createElement('i');
      patch.style.background = color;
      entry.append(patch, name);
      this.legend.append(entry);
      this.names.push(name);
    }
    this.rows.push(values);
    if (this.rows.length > LENGTH) this.rows.shift();
    this.draw();
  }

  draw() {
    const { canvas, names, rows } = this, pen = canvas.getContext('2d');
    const sums = rows.map((row) => {
      let sum = 0;
      return names.map((name) => this.stacked ? (sum += row[name] ?? 0) : row[name] ?? 0);
    });
    const flat = sums.flat();
    const low = Math.min(0, ...flat), high = Math.max(...flat, low + 1e-12);
    const x = (k) => k / (LENGTH - 1) * canvas.width;
    const y = (value) => 2 + (high - value) / (high - low) * (canvas.height - 4);
    pen.clearRect(0, 0, canvas.width, canvas.height);
    for (let n = names.length - 1; n >= 0; n--) {
      pen.beginPath();
      sums.forEach((row, k) => pen.lineTo(x(k), y(row[n])));
      pen.strokeStyle = pen.fillStyle = COLORS[n % COLORS.length];
      if (this.stacked) {
        pen.lineTo(x(sums.length - 1), y(0));
        pen.lineTo(0, y(0));
        pen.fill();
      } else {
        pen.stroke();
      }
    }
    pen.fillStyle = '#66727e';
    pen.font = '10px system-ui';
    pen.fillText(high.toPrecision(3), 2, 10);
    if (low < 0) pen.fillText(low.toPrecision(3), 2, canvas.height - 2);
  }
}
