"""An instance of an exported FMU, for tests."""


class Instance:
    """An instantiated FMU, whatever its version."""

    def __init__(self, path, folder, name="one"):
        import fmpy
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        self.description = fmpy.read_model_description(str(path))
        self.place = {v.name: v.valueReference for v in self.description.modelVariables}
        self.fmi = int(self.description.fmiVersion[0])
        fmpy.extract(str(path), unzipdir=str(folder))
        maker = FMU2Slave if self.fmi == 2 else FMU3Slave
        self.fmu = maker(
            guid=self.description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.said = []
        self.fmu.instantiate(**self.logging())

    def logging(self):
        if self.fmi == 3:
            return {
                "loggingOn": True,
                "logMessage": lambda env, status, category, text: self.said.append(text.decode()),
            }
        from fmpy.fmi2 import defaultCallbacks

        return {"loggingOn": False, "callbacks": defaultCallbacks}

    def begin(self, **values):
        self.set(**values)
        if self.fmi == 2:
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def set(self, **values):
        real = self.fmu.setReal if self.fmi == 2 else self.fmu.setFloat64
        for name, value in values.items():
            if isinstance(value, bool):
                self.fmu.setBoolean([self.place[name]], [value])
            else:
                real([self.place[name]], [value])

    def report(self, reported, **more):
        """What a drive reports, and other inputs."""
        drive = {name: getattr(reported, name) for name in ("motor_speed", "motor_torque", "oil_temperature")}
        self.set(**drive, **more)

    def get(self, name):
        if name in ("status", "verdict", "quality"):
            whole = self.fmu.getInteger if self.fmi == 2 else self.fmu.getInt64
            return whole([self.place[name]])[0]
        real = self.fmu.getReal if self.fmi == 2 else self.fmu.getFloat64
        return real([self.place[name]])[0]

    def step(self, time, step):
        self.fmu.doStep(time, step)
