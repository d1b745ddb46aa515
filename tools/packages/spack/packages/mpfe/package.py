"""Recipe of Spack: spack repo add tools/packages/spack; spack install mpfe. It builds the clone that it lies in."""
import os

from spack.package import *

TOP = os.path.abspath(os.path.join(os.path.dirname(__file__), *[os.pardir] * 5))


class Mpfe(MakefilePackage):
    """Implicit material points and finite elements for brittle fracture."""

    git = "file://" + TOP
    license("GPL-3.0-only")
    version("main", branch="main")

    depends_on("cxx", type="build")
    depends_on("mpi")
    depends_on("eigen@3.4:")
    depends_on("gsl")
    depends_on("muparser")
    depends_on("metis@5:")
    depends_on("suite-sparse")
    depends_on("mumps+mpi+double")
    depends_on("openblas")
    depends_on("python@3.8:", type="run")
    depends_on("py-numpy", type="run")
    depends_on("py-matplotlib", type="run")

    def _words(self):
        """Paths for tools/machines/cluster.mk; the compiler wrapper of Spack chooses the processor."""
        spec = self.spec
        words = ["MACHINE=cluster", "CXX=" + spec["mpi"].mpicxx, "CXXFLAGS=-O3", "PREFIX=" + self.prefix]
        for name, package in (("EIGEN", "eigen"), ("MUMPS", "mumps"), ("METIS", "metis"), ("SUITESPARSE", "suite-sparse"),
                              ("OPENBLAS", "openblas"), ("GSL", "gsl"), ("MUPARSER", "muparser")):
            words.append("%s=%s" % (name, spec[package].prefix))
        return words

    def build(self, spec, prefix):
        make("all", *self._words())

    def install(self, spec, prefix):
        make("install_files", *self._words())
