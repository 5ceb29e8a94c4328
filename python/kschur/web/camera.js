// A view in parallel from an azimuth and an elevation (degrees), which the pointer turns, shifts and zooms; z is up.
class Camera {
  constructor(box) {
    this.middle = box.getCenter(new THREE.Vector3());
    this.size = Math.max(box.getSize(new THREE.Vector3()).length(), 1e-30);
    this.corners = [0, 1, 2, 3, 4, 5, 6, 7].map(k => new THREE.Vector3(k & 1 ? box.max.x : box.min.x, k & 2 ? box.max.y : box.min.y, k & 4 ? box.max.z : box.min.z));
    this.lens = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 20 * this.size);
    this.look(-60, 25);
  }

  look(azimuth, elevation) {
    Object.assign(this, {azimuth, elevation, zoom: 1, shift: [0, 0]});
  }

  // Unit vectors to the right, up, and towards who looks.
  axes() {
    const a = this.azimuth * Math.PI / 180, e = this.elevation * Math.PI / 180;
    return [new THREE.Vector3(-Math.sin(a), Math.cos(a), 0),
            new THREE.Vector3(-Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e)),
            new THREE.Vector3(Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e))];
  }

  // Half the height of what a pane of this size shows, so that the structure and its motion fit.
  halfHeight(width, height, margin) {
    const [right, up] = this.axes(), reach = axis => Math.max(...this.corners.map(c => Math.abs(c.clone().sub(this.middle).dot(axis))));
    const room = margin * this.size;
    return Math.max(1.12 * (reach(up) + room), 1.12 * (reach(right) + room) * height / width) / this.zoom;
  }

  place(width, height, margin) {
    const [right, up, back] = this.axes(), half = this.halfHeight(width, height, margin);
    Object.assign(this.lens, {left: -half * width / height, right: half * width / height, top: half, bottom: -half});
    this.lens.updateProjectionMatrix();
    const from = this.middle.clone().addScaledVector(right, this.shift[0]).addScaledVector(up, this.shift[1]);
    this.lens.matrixAutoUpdate = false;
    this.lens.matrix.makeBasis(right, up, back).setPosition(from.addScaledVector(back, 10 * this.size));
    this.lens.updateMatrixWorld(true);
    return 2 * half / height;  // length of a pixel
  }

  follow(element, lengthOfPixel) {
    element.addEventListener("pointerdown", event => element.setPointerCapture(event.pointerId));
    element.addEventListener("contextmenu", event => event.preventDefault());
    element.addEventListener("pointermove", event => {
      if (!event.buttons) return;
      if (event.shiftKey || event.buttons > 1) {
        this.shift[0] -= event.movementX * lengthOfPixel();
        this.shift[1] += event.movementY * lengthOfPixel();
      } else {
        this.azimuth -= 0.4 * event.movementX;
        this.elevation = Math.max(-90, Math.min(90, this.elevation + 0.4 * event.movementY));
      }
    });
    element.addEventListener("wheel", event => {
      event.preventDefault();
      this.zoom = Math.max(0.05, Math.min(200, this.zoom * Math.exp(-0.0012 * event.deltaY)));
    }, {passive: false});
  }
}
