/* ---- materials: colours and pictures ---- */

const LARGEST_PICTURE = 1024, PICTURE_UNIT = 6;

/* Those that the browser cannot show are left out: null. */
async function loadPictures(addresses) {
    return Promise.all(addresses.map(async (address) => {
        const image = new Image();
        image.src = address;
        try {
            await image.decode();
        } catch {
            return null;
        }
        return image;
    }));
}

/* All pictures as layers of one texture, of the size of the largest, first row at the top. */
function pictureTexture(pictures) {
    const largest = Math.max(...pictures.map((p) => p ? Math.max(p.naturalWidth, p.naturalHeight) : 1));
    const size = Math.min(LARGEST_PICTURE, 2 ** Math.ceil(Math.log2(Math.max(largest, 1)))), texture = gl.createTexture();
    const canvas = document.createElement("canvas"), pen = canvas.getContext("2d", {willReadFrequently: true});
    canvas.width = canvas.height = size;
    gl.activeTexture(gl.TEXTURE0 + PICTURE_UNIT);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, texture);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, Math.log2(size) + 1, gl.RGBA8, size, size, pictures.length);
    pictures.forEach((picture, i) => {
        pen.clearRect(0, 0, size, size);
        if (picture) pen.drawImage(picture, 0, 0, size, size);
        gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, i, size, size, 1, gl.RGBA, gl.UNSIGNED_BYTE, pen.getImageData(0, 0, size, size));
    });
    gl.generateMipmap(gl.TEXTURE_2D_ARRAY);
    gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.activeTexture(gl.TEXTURE0);
    return texture;
}

/* Of each corner: the colour of its material and from where on it is opaque; u, v and number of its picture. */
function makeLooks(s) {
    const n = s.corners.length, looks = new Float32Array(4 * n), spots = new Float32Array(3 * n);
    const uv = s.coordinates ? new Float32Array(s.coordinates.buffer) : null;
    for (let c = 0; c < n; c++) {
        const material = s.about.materials[s.materials[s.faceOf[c]] - 1];
        if (material) looks.set([...material.colour, material.cutoff || 0], 4 * c);
        const picture = material && uv && material.picture !== undefined && s.pictures[material.picture] ? material.picture : -1;
        spots.set(material ? [uv ? uv[2 * c] : 0, uv ? 1 - uv[2 * c + 1] : 0, picture] : [0, 0, -2], 3 * c);
    }
    s.pictureTexture = s.pictures.length ? pictureTexture(s.pictures) : null;
    return {looks: makeBuffer(gl.ARRAY_BUFFER, looks), spots: makeBuffer(gl.ARRAY_BUFFER, spots)};
}

function bindLooks({looks, spots}) {
    for (const [location, buffer, width] of [[4, looks, 4], [5, spots, 3]]) {
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.enableVertexAttribArray(location);
        gl.vertexAttribPointer(location, width, gl.FLOAT, false, 0, 0);
    }
}

/* A sampler needs a texture of its kind even where it is not read. */
function showPictures(s, sampler) {
    gl.uniform1i(sampler, PICTURE_UNIT);
    gl.activeTexture(gl.TEXTURE0 + PICTURE_UNIT);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, s.pictureTexture || null);
    gl.activeTexture(gl.TEXTURE0);
}
