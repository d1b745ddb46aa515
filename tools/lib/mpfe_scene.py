"""Draws surfaces in space by VTK, off screen, for tools/plot: smooth shading, contours between the nodes, edges of features.

An X server is needed (python3-vtk9 and xvfb of Debian); Xvfb is started for the time of the script.
"""
import atexit
import os
import shutil
import subprocess

from mpfe_files import np

FINER = 2                      # pixels of the scene to one of the picture, in both directions
FEATURE = 35.0                 # degrees between two faces from which on their edge is one of the body


def quiet_display():
    """Starts Xvfb and sets DISPLAY; False: it is not there."""
    if not shutil.which("Xvfb"):
        return False
    read, write = os.pipe()
    server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x1024x24", "-nolisten", "tcp"],
                              pass_fds=[write], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as f:
        number = f.readline().strip()
    if not number:
        return False
    atexit.register(server.terminate)
    os.environ["DISPLAY"] = ":" + number
    return True


def available():
    """Are VTK and a display there? Starts the display."""
    if not Scene.vtk:
        if os.environ.get("MPFE_PLOT") == "matplotlib":
            return False
        try:
            import vtkmodules.vtkRenderingOpenGL2      # noqa: F401
            import vtkmodules.vtkInteractionStyle      # noqa: F401
            from vtkmodules import vtkCommonCore, vtkCommonDataModel, vtkFiltersCore, vtkRenderingCore
            from vtkmodules.util import numpy_support
        except ImportError:
            return False
        if not (quiet_display() or os.environ.get("DISPLAY")):
            return False
        Scene.vtk = {"core": vtkCommonCore, "data": vtkCommonDataModel, "filters": vtkFiltersCore, "render": vtkRenderingCore,
                     "numpy": numpy_support}
    return True


def directions(elev, azim):
    """Unit vectors to the right and up in the picture, and to the eye."""
    e, a = np.radians([elev, azim])
    return (np.array([-np.sin(a), np.cos(a), 0.0]), np.array([-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)]),
            np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]))


class Scene:
    """Actors of a picture, seen from a direction without perspective."""
    vtk = {}

    def __init__(self, elev, azim):
        self.right, self.up, self.eye = directions(elev, azim)
        self.renderer = self.vtk["render"].vtkRenderer()
        self.renderer.SetBackground(1.0, 1.0, 1.0)
        self.add_lights()

    def add_lights(self):
        """A key light from above left, one from the eye and a weak one from below right."""
        self.renderer.AutomaticLightCreationOff()
        for at, strength in (((-0.4, 0.7, 0.8), 0.52), ((0.0, 0.0, 1.0), 0.35), ((0.9, -0.2, 0.3), 0.25)):
            light = self.vtk["render"].vtkLight()
            light.SetLightTypeToSceneLight()
            light.SetPositional(False)
            light.SetPosition(*(at[0] * self.right + at[1] * self.up + at[2] * self.eye))
            light.SetFocalPoint(0.0, 0.0, 0.0)
            light.SetIntensity(strength)
            self.renderer.AddLight(light)

    def poly(self, points, cells, kind):
        """vtkPolyData of faces [n, 4] (a triangle has its last node twice), lines [n, 2] or dots."""
        to_vtk, data = self.vtk["numpy"].numpy_to_vtk, self.vtk["data"]
        out, place, array = data.vtkPolyData(), self.vtk["core"].vtkPoints(), data.vtkCellArray()
        place.SetData(to_vtk(np.ascontiguousarray(points, float), deep=True))
        cells = np.asarray(cells)
        three = cells[:, 3] == cells[:, 2] if cells.shape[1] == 4 else np.zeros(len(cells), bool)
        size = np.where(three, 3, cells.shape[1])
        flat = np.concatenate([c[:n] for c, n in zip(cells, size)]) if three.any() else cells.ravel()
        array.SetData(self.vtk["numpy"].numpy_to_vtkIdTypeArray(np.concatenate([[0], np.cumsum(size)]).astype(np.int64), deep=True),
                      self.vtk["numpy"].numpy_to_vtkIdTypeArray(flat.astype(np.int64), deep=True))
        out.SetPoints(place)
        getattr(out, {"faces": "SetPolys", "lines": "SetLines", "dots": "SetVerts"}[kind])(array)
        return out

    def add(self, source, colour=None, table=None, width=1.0):
        """An actor of poly data or of a filter's output."""
        mapper, actor = self.vtk["render"].vtkPolyDataMapper(), self.vtk["render"].vtkActor()
        if hasattr(source, "GetOutputPort"):
            mapper.SetInputConnection(source.GetOutputPort())
        else:
            mapper.SetInputData(source)
        mapper.SetScalarVisibility(table is not None)
        if table is not None:
            mapper.SetLookupTable(table)
            mapper.UseLookupTableScalarRangeOn()
            mapper.InterpolateScalarsBeforeMappingOn()
        actor.SetMapper(mapper)
        look = actor.GetProperty()
        if colour is not None:
            look.SetColor(*colour)
        look.SetAmbient(0.48)
        look.SetDiffuse(0.68)
        look.SetSpecular(0.08)
        look.SetSpecularPower(20.0)
        look.SetLineWidth(width * FINER)
        look.SetPointSize(3.0 * width * FINER)
        self.renderer.AddActor(actor)
        return actor

    def table(self, cmap, lo, hi):
        colours = (255 * cmap(np.linspace(0.0, 1.0, 256))).round().astype(np.uint8)
        table = self.vtk["core"].vtkLookupTable()
        table.SetTable(self.vtk["numpy"].numpy_to_vtk(colours, deep=True))
        table.SetTableRange(lo, hi)
        return table

    def surface(self, points, faces, value=None, table=None, colour=(0.8, 0.8, 0.8), smooth=True, edges=None):
        """Faces with values at nodes or, when there are as many as faces, of faces, or in one colour; edges: width of those of features, None: without; "all": of all faces."""
        if not len(faces):
            return
        used, inverse = np.unique(faces, return_inverse=True)
        data = self.poly(points[used], inverse.reshape(-1, 4), "faces")
        if value is not None:
            of_faces = len(value) == len(faces) and len(value) != len(points)
            scalars = self.vtk["numpy"].numpy_to_vtk(np.ascontiguousarray(value if of_faces else value[used], float), deep=True)
            (data.GetCellData() if of_faces else data.GetPointData()).SetScalars(scalars)
        normals = self.vtk["filters"].vtkPolyDataNormals()
        normals.SetInputData(data)
        normals.SetFeatureAngle(FEATURE)
        normals.SplittingOn()
        normals.ConsistencyOff()
        if smooth:
            actor = self.add(normals, colour, table if value is not None else None)
        else:
            actor = self.add(data, colour, table if value is not None else None)
            actor.GetProperty().SetInterpolationToFlat()
        if edges == "all":
            actor.GetProperty().EdgeVisibilityOn()
            actor.GetProperty().SetEdgeColor(0.15, 0.15, 0.15)
            actor.GetProperty().SetLineWidth(0.4 * FINER)
        elif edges:
            found = self.vtk["filters"].vtkFeatureEdges()
            found.SetInputData(data)
            found.SetFeatureAngle(FEATURE)
            found.BoundaryEdgesOn()
            found.FeatureEdgesOn()
            found.NonManifoldEdgesOff()
            found.ManifoldEdgesOff()
            found.ColoringOff()
            self.add(found, (0.12, 0.12, 0.12), None, edges)

    def lines(self, segments, colour, width):
        """Segments [n, 2, 3]."""
        if len(segments):
            self.add(self.poly(segments.reshape(-1, 3), np.arange(2 * len(segments)).reshape(-1, 2), "lines"), colour, None, width)

    def dots(self, points, colour, width):
        if len(points):
            actor = self.add(self.poly(points, np.arange(len(points)).reshape(-1, 1), "dots"), colour, None, width)
            actor.GetProperty().RenderPointsAsSpheresOn()

    def image(self, box, width, height):
        """The picture [height, width, 3] of the scene and the length of a pixel; box: points that must lie in it."""
        across, high = box @ self.right, box @ self.up
        middle = (0.5 * (across.min() + across.max()) * self.right + 0.5 * (high.min() + high.max()) * self.up
                  + box.mean(axis=0) @ self.eye * self.eye)
        size = 1.04 * max(high.max() - high.min(), (across.max() - across.min()) * height / width, 1e-300)
        far = 2.0 * np.linalg.norm(box.max(axis=0) - box.min(axis=0)) + size
        camera = self.renderer.GetActiveCamera()
        camera.ParallelProjectionOn()
        camera.SetFocalPoint(*middle)
        camera.SetPosition(*(middle + far * self.eye))
        camera.SetViewUp(*self.up)
        camera.SetParallelScale(0.5 * size)
        self.renderer.ResetCameraClippingRange()
        window = self.vtk["render"].vtkRenderWindow()
        window.SetOffScreenRendering(1)
        window.SetMultiSamples(4)
        window.SetSize(FINER * width, FINER * height)
        window.AddRenderer(self.renderer)
        window.Render()
        grab = self.vtk["render"].vtkWindowToImageFilter()
        grab.SetInput(window)
        grab.ReadFrontBufferOff()
        grab.Update()
        picture = self.vtk["numpy"].vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
        picture = picture.reshape(FINER * height, FINER * width, 3)[::-1]
        picture = picture.reshape(height, FINER, width, FINER, 3).mean(axis=(1, 3)) / 255.0
        window.RemoveRenderer(self.renderer)
        return picture, size / height
