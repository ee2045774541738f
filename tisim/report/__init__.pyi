from .cost_report import cost_report as cost_report
from .run_report import read_checks as read_checks
from .run_report import run_report as run_report
from .view import view as view
from .viewer_data import ReportOptions as ReportOptions
